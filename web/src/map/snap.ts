/** Where a drawn point or line lands: on walls and dividers near to it, as the service would have it. */

import type { Position } from "./document";
import type { Line } from "./operations";

export type Segment = Line;
export interface Snapped {
  readonly at: Position;
  /** A corner beats an edge that is as near. */
  readonly onto: "corner" | "edge" | null;
}

const CORNER_BONUS = 1.6;

/** The nearest point of the segments within `reach` metres; corners draw from farther than edges. */
export function snap(point: Position, segments: readonly Segment[], reach: number): Snapped {
  let best: Snapped = { at: point, onto: null };
  let least = reach;
  for (const segment of segments) {
    for (const corner of segment) {
      const distance = gap(point, corner) / CORNER_BONUS;
      if (distance < least && gap(point, corner) <= reach) [best, least] = [{ at: corner, onto: "corner" }, distance];
    }
    const nearest = nearestOn(segment, point);
    const distance = gap(point, nearest);
    if (distance < least) [best, least] = [{ at: nearest, onto: "edge" }, distance];
  }
  return best;
}

export const gap = ([ax, ay]: Position, [bx, by]: Position): number => Math.hypot(ax - bx, ay - by);

export function nearestOn([[ax, ay], [bx, by]]: Segment, [x, y]: Position): Position {
  const [dx, dy] = [bx - ax, by - ay];
  const length2 = dx * dx + dy * dy;
  const t = length2 === 0 ? 0 : Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / length2));
  return [ax + t * dx, ay + t * dy];
}

export const REACH_M = 0.5;
const TOUCH_M = 0.005;

/** A line whose ends lie on walls or dividers; or the end that finds none, how far it is from the nearest, and the line that would do. */
export type Attached =
  | { readonly ok: true; readonly line: Line }
  | { readonly ok: false; readonly end: 0 | 1; readonly gap: number; readonly extended: Line | null };

/**
 * Each end goes to the first wall or divider along the line within reach, else to the nearest one: the service's own rule, so that
 * what is shown while drawing is what will be saved.
 */
export function attach(line: Line, segments: readonly Segment[]): Attached {
  const length = gap(...line);
  if (length < TOUCH_M) return { ok: false, end: 1, gap: 0, extended: null };
  const stations = crossings(line, segments);
  const ends = [0, 1].map((end) => attachEnd(line, end as 0 | 1, length, stations, segments));
  for (const end of [0, 1] as const) {
    const found = ends[end];
    if (typeof found === "number") return { ok: false, end, gap: found, extended: extended(line, length, stations) };
  }
  return { ok: true, line: [ends[0] as Position, ends[1] as Position] };
}

/** Where the end comes to lie, or how far it is from anything. */
function attachEnd(
  line: Line,
  end: 0 | 1,
  length: number,
  stations: readonly number[],
  segments: readonly Segment[],
): Position | number {
  const point = line[end];
  let nearest: Position | null = null;
  let least = Infinity;
  for (const segment of segments) {
    const candidate = nearestOn(segment, point);
    const distance = gap(point, candidate);
    if (distance < least) [nearest, least] = [candidate, distance];
  }
  if (nearest && least < TOUCH_M) return nearest;
  const at = end === 0 ? 0 : length;
  const inward = end === 0 ? 1 : -1;
  const outward = stations
    .map((station) => (at - station) * inward)
    .filter((beyond) => beyond <= REACH_M && -beyond <= Math.min(REACH_M, length / 2));
  if (outward.length > 0) return along(line, length, at - Math.min(...outward) * inward);
  return nearest && least <= REACH_M ? nearest : least;
}

/** Distances from the line's start at which its endless extension meets a segment, rising. */
function crossings([[ax, ay], [bx, by]]: Line, segments: readonly Segment[]): number[] {
  const length = Math.hypot(bx - ax, by - ay);
  const [ux, uy] = [(bx - ax) / length, (by - ay) / length];
  const found: number[] = [];
  for (const [[px, py], [qx, qy]] of segments) {
    const [vx, vy] = [qx - px, qy - py];
    const cross = ux * vy - uy * vx;
    if (Math.abs(cross) < 1e-9) continue;
    const [wx, wy] = [px - ax, py - ay];
    const t = (wx * uy - wy * ux) / cross;
    if (t >= -1e-9 && t <= 1 + 1e-9) found.push((wx * vy - wy * vx) / cross);
  }
  return found.sort((a, b) => a - b);
}

const along = ([[ax, ay], [bx, by]]: Line, length: number, station: number): Position => [
  ax + ((bx - ax) * station) / length,
  ay + ((by - ay) * station) / length,
];

/** The line drawn on to the next wall on both sides of its middle. */
function extended(line: Line, length: number, stations: readonly number[]): Line | null {
  const before = stations.filter((station) => station < length / 2 - TOUCH_M);
  const after = stations.filter((station) => station > length / 2 + TOUCH_M);
  const start = before.filter((station) => station <= REACH_M / 10).at(-1) ?? before[0];
  const end = after.find((station) => station >= length - REACH_M / 10) ?? after.at(-1);
  return start === undefined || end === undefined ? null : [along(line, length, start), along(line, length, end)];
}
