/** What the review page can show: pure, all in the frame of the mission that is asked about. */

import type { Schemas } from "../api/client";
import type { MapDocument, MapFeature, Position } from "../map/document";
import type { Bounds } from "../map/geometry";
import { movedDocument, type Pose } from "../map/moved";
import { type Conflict, isDiscovery } from "../map/questions";
import { type MapView, viewMap } from "../map/view";
import { focusOn } from "./changes";

export type Sensed = Schemas["SensedDocument"];
type Proposal = Conflict["proposals"][number];

export interface Scene {
  readonly document: MapDocument;
  readonly view: MapView;
}

/** Proposals whose map is another than the one before, the recommended one first. */
export function shownProposals(conflict: Conflict): Proposal[] {
  const shown = conflict.proposals.filter(({ action }) => action !== "keep_previous" || isDiscovery(conflict));
  return shown.sort((a, b) => Number(b.recommended) - Number(a.recommended));
}

export const carried = (document: MapDocument, pose: Pose | null): MapDocument =>
  pose === null ? document : movedDocument(document, pose);

/** A proposal's map lies on the mission's grid, or on the one of the version in force. */
export function proposedDocument(document: MapDocument, conflict: Conflict, sensed: Sensed): MapDocument {
  return document.mission === conflict.mission ? document : carried(document, sensed.moved_now);
}

/** With the rooms that drifted where somebody last confirmed them. */
export function confirmedDocument(document: MapDocument, { confirmed }: Sensed): MapDocument {
  const places = new Map(confirmed.map(({ room, geometry }) => [room, geometry]));
  const placed = (feature: MapFeature) => ({ ...feature, geometry: places.get(feature.id) ?? feature.geometry });
  return { ...document, features: document.features.map(placed) as MapFeature[] };
}

/** Nothing but the robot's picture. */
export function seenDocument(like: MapDocument, sensed: Sensed): MapDocument {
  return { ...like, version: 0, frame: sensed.frame, grid: sensed.grid, cells: sensed.cells, features: [] };
}

/** Where a person has to look: at what is asked about and what would be added, else at what changed most. `documents`: before, after. */
export function focusOf(conflict: Conflict, documents: readonly MapDocument[], sensed: Sensed): Bounds | null {
  const ids = new Set([...conflict.rooms.map(({ id }) => id), ...conflict.dividers, ...conflict.restrictions]);
  const rooms = new Set(conflict.rooms.map(({ id }) => id));
  const known = new Set(documents[0]?.features.map(({ id }) => id));
  const isNew = ({ id, properties }: MapFeature) => properties.semantic === "room" && !known.has(id);
  const all = documents.flatMap(({ features }) => features);
  const named = all.filter((one) => (rooms.size > 0 ? rooms.has(one.id) : ids.has(one.id)) || isNew(one));
  const proposed = conflict.proposals.flatMap(({ features }) => features.filter(isAddition));
  const shapes: readonly Pick<MapFeature, "geometry">[] = [...named, ...proposed, ...sensed.confirmed];
  const largest = sensed.differences[0]?.geometry.coordinates[0] ?? [];
  return focusOn(shapes.length > 0 ? shapes.flatMap(pointsOf) : largest);
}

const pointsOf = ({ geometry }: Pick<MapFeature, "geometry">): Position[] =>
  geometry.type === "Polygon" ? geometry.coordinates.flat() : geometry.coordinates;

type Addition = MapView["proposed"][number];

const isAddition = (feature: MapFeature): feature is Addition =>
  ["divider", "meta_divider", "meta_occupancy"].includes(feature.properties.semantic);

interface Showing {
  readonly focus: Bounds | null;
  readonly sensed: Sensed;
  readonly proposal?: Proposal | undefined;
  /** Where the document has no bounds of its own. */
  readonly bounds?: Bounds;
}

export function scene(document: MapDocument, { focus, sensed, proposal, bounds }: Showing): Scene {
  const view = viewMap(document);
  return {
    document,
    view: {
      ...view,
      bounds: bounds ?? view.bounds,
      focus,
      changed: [
        ...sensed.differences.map(({ change, geometry }) => ({ change, rings: geometry.coordinates })),
        ...sensed.confirmed.map(({ geometry }) => ({ change: "confirmed" as const, rings: geometry.coordinates })),
      ],
      proposed: proposal?.features.filter(isAddition) ?? [],
    },
  };
}
