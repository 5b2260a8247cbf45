/** Where the robot saw something else than was known, as a list that can be read aloud. */

import type { Schemas } from "../api/client";
import type { Position } from "../map/document";
import { type Bounds, boundsOf, isEmpty } from "../map/geometry";
import { type MapView, type RoomView, roomAt } from "../map/view";

export type Difference = Schemas["DifferenceDocument"];

export interface ChangedPlace {
  readonly change: Difference["change"];
  /** Null: in none. */
  readonly room: RoomView | null;
  /** Square metres. */
  readonly area: number;
}

/** By room and kind of change, those of `concerned` rooms first, then the larger ones. */
export function changedPlaces(
  differences: readonly Difference[],
  before: MapView,
  concerned: readonly string[],
): ChangedPlace[] {
  const places = new Map<string, ChangedPlace>();
  for (const { change, area, geometry } of differences) {
    const room = roomAround(before, geometry.coordinates[0] ?? []);
    const key = `${change} ${room?.id}`;
    places.set(key, { change, room, area: (places.get(key)?.area ?? 0) + area });
  }
  const rank = ({ room }: ChangedPlace) => Number(room !== null && concerned.includes(room.id));
  return [...places.values()].sort((a, b) => rank(b) - rank(a) || b.area - a.area);
}

/** The room in which most of a ring's corners lie. */
function roomAround(view: MapView, ring: readonly Position[]): RoomView | null {
  const votes = new Map<RoomView, number>();
  for (const point of ring) {
    const room = roomAt(view, point);
    if (room) votes.set(room, (votes.get(room) ?? 0) + 1);
  }
  return [...votes].sort(([, a], [, b]) => b - a)[0]?.[0] ?? null;
}

const MARGIN_M = 0.6;
const LEAST_M = 3;

/** What to look at: all these points with some room around them; null where there are none. */
export function focusOn(points: Iterable<Position>): Bounds | null {
  const bounds = boundsOf(points);
  if (isEmpty(bounds)) return null;
  const [west, south, east, north] = bounds;
  const grow = (size: number) => Math.max(MARGIN_M, (LEAST_M - size) / 2);
  const [x, y] = [grow(east - west), grow(north - south)];
  return [west - x, south - y, east + x, north + y];
}
