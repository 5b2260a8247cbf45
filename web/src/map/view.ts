/** From a map document to what a page shows of it. */

import { colourRooms } from "./colours";
import type {
  ClutterFeature,
  DividerFeature,
  MapDocument,
  MapFeature,
  MetaDividerFeature,
  MetaOccupancyFeature,
  PhantomFeature,
  Position,
  RestrictionFeature,
  Ring,
  RoomFeature,
  WallFeature,
} from "./document";
import {
  type Bounds,
  boundsOf,
  contains,
  frameBounds,
  isEmpty,
  type LabelSpot,
  labelSpot,
  outlineDistance,
} from "./geometry";

export type Passage = "open" | "door" | "meta";

export interface Neighbour {
  readonly id: string;
  readonly name: string;
  readonly passages: readonly Passage[];
}

export interface RoomView {
  readonly id: string;
  readonly name: string;
  readonly segmentId: number;
  readonly area: number;
  readonly rings: readonly Ring[];
  readonly slot: number;
  readonly label: LabelSpot;
  readonly neighbours: readonly Neighbour[];
  readonly lastVisited: string | null;
  readonly pinned: boolean;
  readonly kind: RoomFeature["properties"]["kind"];
}

/** A place where the robot saw something else than was known, or where a room was when somebody last confirmed it. */
export interface Changed {
  readonly change: "blocked" | "opened" | "found" | "unseen" | "confirmed";
  readonly rings: readonly Ring[];
}

export interface MapView {
  /** By name, as a person would sort them. */
  readonly rooms: readonly RoomView[];
  readonly dividers: readonly DividerFeature[];
  readonly walls: readonly WallFeature[];
  readonly clutter: readonly ClutterFeature[];
  readonly metaDividers: readonly MetaDividerFeature[];
  readonly metaOccupancy: readonly MetaOccupancyFeature[];
  readonly restrictions: readonly RestrictionFeature[];
  readonly phantoms: readonly PhantomFeature[];
  readonly changed: readonly Changed[];
  /** What would be added to the map if somebody agreed. */
  readonly proposed: readonly (DividerFeature | MetaDividerFeature | MetaOccupancyFeature)[];
  /** What to fit on the screen: rooms and walls, or the whole grid where there are none. */
  readonly bounds: Bounds;
  /** What to show first; null: all of it. */
  readonly focus: Bounds | null;
  readonly area: number;
}

/** Rooms this close are seen as neighbours although no divider joins them: a thick wall lies between. */
const BESIDE_M = 0.5;

const byName = new Intl.Collator("en", { numeric: true, sensitivity: "base" });

export function viewMap(document: MapDocument): MapView {
  const features = document.features;
  const roomFeatures = only(features, "room");
  const dividers = only(features, "divider");
  const metaDividers = only(features, "meta_divider");
  const walls = only(features, "wall");
  const passages = findPassages(dividers, metaDividers);
  const slots = colourRooms(
    roomFeatures.map((room) => ({
      id: room.id,
      segmentId: room.properties.segment_id,
      beside: roomFeatures.filter((other) => other !== room && areBeside(room, other)).map((other) => other.id),
    })),
  );
  const names = new Map(roomFeatures.map((room) => [room.id, room.properties.name]));
  const rooms = roomFeatures
    .map((room) => viewRoom(room, slots.get(room.id) ?? 0, passages.get(room.id) ?? new Map(), names))
    .sort((a, b) => byName.compare(a.name, b.name) || a.segmentId - b.segmentId);
  const bounds = boundsOf(shapePoints([...roomFeatures, ...walls]));
  return {
    rooms,
    dividers,
    walls,
    clutter: only(features, "clutter"),
    metaDividers,
    metaOccupancy: only(features, "meta_occupancy"),
    restrictions: only(features, "restriction"),
    phantoms: only(features, "phantom"),
    changed: [],
    proposed: [],
    focus: null,
    bounds: isEmpty(bounds) ? frameBounds(document.frame) : bounds,
    area: rooms.reduce((sum, room) => sum + room.area, 0),
  };
}

/** The room at a point; where rooms overlap, the smallest, as the larger ones can be reached beside it. */
export function roomAt(view: MapView, point: Position): RoomView | undefined {
  return view.rooms.filter((room) => contains(room.rings, point)).sort((a, b) => a.area - b.area)[0];
}

type Semantic = MapFeature["properties"]["semantic"];
type OfSemantic<S extends Semantic> = Extract<MapFeature, { properties: { semantic: S } }>;

function only<S extends Semantic>(features: readonly MapFeature[], semantic: S): OfSemantic<S>[] {
  return features.filter((feature): feature is OfSemantic<S> => feature.properties.semantic === semantic);
}

function* shapePoints(features: readonly (RoomFeature | WallFeature)[]): Generator<Position> {
  for (const { geometry } of features) {
    if (geometry.type === "Polygon") yield* geometry.coordinates.flat();
    else yield* geometry.coordinates;
  }
}

function areBeside(a: RoomFeature, b: RoomFeature): boolean {
  return outlineDistance(a.geometry.coordinates, b.geometry.coordinates, BESIDE_M) < BESIDE_M;
}

/** For each room the rooms behind its dividers, and by what sorts of divider. */
function findPassages(
  dividers: readonly DividerFeature[],
  metaDividers: readonly MetaDividerFeature[],
): Map<string, Map<string, Set<Passage>>> {
  const passages = new Map<string, Map<string, Set<Passage>>>();
  const join = (from: string, to: string, passage: Passage) => {
    const others = passages.get(from) ?? new Map<string, Set<Passage>>();
    passages.set(from, others.set(to, (others.get(to) ?? new Set()).add(passage)));
  };
  const all = [
    ...dividers.map(({ properties }) => ({ rooms: properties.rooms, passage: properties.kind as Passage })),
    ...metaDividers.map(({ properties }) => ({ rooms: properties.rooms, passage: "meta" as const })),
  ];
  for (const { rooms, passage } of all) {
    for (const from of rooms) for (const to of rooms) if (from !== to) join(from, to, passage);
  }
  return passages;
}

function viewRoom(
  { id, geometry, properties }: RoomFeature,
  slot: number,
  passages: ReadonlyMap<string, ReadonlySet<Passage>>,
  names: ReadonlyMap<string, string>,
): RoomView {
  const neighbours = [...passages]
    .flatMap(([other, kinds]) => {
      const name = names.get(other);
      return name === undefined ? [] : [{ id: other, name, passages: [...kinds] }];
    })
    .sort((a, b) => byName.compare(a.name, b.name));
  return {
    id,
    name: properties.name,
    segmentId: properties.segment_id,
    area: properties.area,
    rings: geometry.coordinates,
    slot,
    label: labelSpot(geometry.coordinates),
    neighbours,
    lastVisited: properties.last_visited ?? null,
    pinned: properties.pinned ?? false,
    kind: properties.kind ?? null,
  };
}
