/** A draft applied to a map at once, without the service: what is shown until it answers, and as long as it can't be reached. */

import type { MapDocument, MapFeature, Position, Ring, RoomFeature } from "./document";
import { boundsOf, contains } from "./geometry";
import type { Line, Operation, Operations } from "./operations";
import { areaOf, splitRoom } from "./split";

export interface Projected {
  readonly document: MapDocument;
  readonly made: readonly { readonly pointer: string; readonly feature: string }[];
}

type Features = readonly MapFeature[];

/**
 * Dividers, zones and settings are right; rooms only where one is divided: what merges does so when the service is reached.
 * `names`: what the service calls the things that operations make, so that they keep their names.
 */
export function project(
  document: MapDocument,
  operations: Operations,
  names: ReadonlyMap<number, string> = new Map(),
): Projected {
  let features: Features = document.features;
  const made: { pointer: string; feature: string }[] = [];
  operations.forEach((operation, index) => {
    const id = names.get(index) ?? `new-${index}`;
    const before = features;
    features = applied(features, operation, id);
    if (features.some((one) => one.id === id) && !before.some((one) => one.id === id)) {
      made.push({ pointer: `/operations/${index}`, feature: id });
    }
  });
  return { document: { ...document, features: [...features] }, made };
}

function applied(features: Features, operation: Operation, id: string): Features {
  switch (operation.op) {
    case "add_divider":
      return [...divided(features, operation.line), dividerFeature(id, operation.line, operation.kind)];
    case "move_divider":
      return features.map((one) =>
        one.id === operation.id && one.properties.semantic === "divider"
          ? { ...one, geometry: { type: "LineString", coordinates: operation.line } }
          : one,
      ) as MapFeature[];
    case "set_divider_kind":
      return features.map((one) =>
        one.id === operation.id && one.properties.semantic === "divider"
          ? { ...one, properties: { ...one.properties, kind: operation.kind } }
          : one,
      ) as MapFeature[];
    case "merge_rooms":
      return features.filter(({ properties }) => {
        const rooms =
          properties.semantic === "divider" || properties.semantic === "meta_divider" ? properties.rooms : [];
        return rooms.length < 2 || !rooms.every((room) => operation.ids.includes(room));
      });
    case "rename_room":
      return withRoom(features, operation, { name: operation.name });
    case "set_room_kind":
      return withRoom(features, operation, { kind: operation.kind });
    case "pin_room":
      return withRoom(features, operation, { pinned: operation.pinned });
    case "add_restriction":
      return [...features, zoneFeature(id, operation.kind, operation.shape)];
    case "move_restriction":
      return features.map((one) =>
        one.id === operation.id && one.properties.semantic === "restriction"
          ? zoneFeature(one.id, one.properties.kind, operation.shape)
          : one,
      );
    case "mark_phantom":
      return [
        ...features,
        { type: "Feature", id, geometry: polygon(operation.shape), properties: { semantic: "phantom" } },
      ];
    case "remove_divider":
    case "remove_restriction":
    case "remove_phantom":
      return features.filter((one) => one.id !== operation.id);
    case "accept_meta_divider":
      return features.map((one) =>
        one.id === operation.id && one.properties.semantic === "meta_divider"
          ? dividerFeature(id, one.geometry.coordinates as Position[], "open")
          : one,
      );
  }
}

function divided(features: Features, line: readonly Position[]): Features {
  const [a, b] = line;
  if (!a || !b) return features;
  return features.flatMap((one) => (one.properties.semantic === "room" ? parts(one as RoomFeature, [a, b]) : [one]));
}

/** The larger part is the room itself. */
function parts(room: RoomFeature, line: Line): MapFeature[] {
  if (!mayCut(room.geometry.coordinates, line)) return [room];
  const found = [...splitRoom(room.geometry.coordinates, line)].sort((x, y) => areaOf(y) - areaOf(x));
  return found.map((rings, n) => ({
    ...room,
    id: n === 0 ? room.id : `${room.id}-part-${n + 1}`,
    geometry: { type: "Polygon", coordinates: rings.map((ring) => ring.map(([x, y]): [number, number] => [x, y])) },
    properties: {
      ...room.properties,
      name: n === 0 ? room.properties.name : `${room.properties.name} ${n + 1}`,
      area: areaOf(rings),
      segment_id: n === 0 ? room.properties.segment_id : room.properties.segment_id + 3 * n,
    },
  }));
}

export function mayCut(rings: readonly Ring[], line: Line): boolean {
  const [west, south, east, north] = boundsOf(rings.flat());
  const [w, s, e, n] = boundsOf(line);
  return w <= east && e >= west && s <= north && n >= south;
}

function withRoom(
  features: Features,
  which: { readonly id?: string | null; readonly at?: readonly [number, number] | null },
  values: Partial<RoomFeature["properties"]>,
): Features {
  const isMeant = (room: RoomFeature) =>
    which.at ? contains(room.geometry.coordinates, which.at) : room.id === which.id;
  return features.map((one) =>
    one.properties.semantic === "room" && isMeant(one as RoomFeature)
      ? ({ ...one, properties: { ...one.properties, ...values } } as MapFeature)
      : one,
  );
}

function dividerFeature(id: string, line: readonly Position[], kind: "open" | "door"): MapFeature {
  return {
    type: "Feature",
    id,
    geometry: { type: "LineString", coordinates: line.map(([x, y]): [number, number] => [x, y]) },
    properties: { semantic: "divider", kind, made_by: "user", rooms: [] },
  };
}

function zoneFeature(
  id: string,
  kind: "no_go" | "no_mop" | "virtual_wall",
  shape: readonly (readonly [number, number])[],
): MapFeature {
  const geometry =
    kind === "virtual_wall"
      ? ({ type: "LineString", coordinates: shape.map(([x, y]): [number, number] => [x, y]) } as const)
      : polygon(shape);
  return { type: "Feature", id, geometry, properties: { semantic: "restriction", kind, placement: "placed" } };
}

function polygon(shape: readonly (readonly [number, number])[]): {
  type: "Polygon";
  coordinates: [number, number][][];
} {
  const ring = shape.map(([x, y]): [number, number] => [x, y]);
  return { type: "Polygon", coordinates: [ring[0] ? [...ring, ring[0]] : ring] };
}
