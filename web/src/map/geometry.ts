/** Plane geometry in the map frame. Lengths in metres unless a name says otherwise. */

import polylabel from "polylabel";
import type { Frame, Position, Ring } from "./document";

/** [west, south, east, north] */
export type Bounds = readonly [number, number, number, number];

/** Column-major 2 x 3, as `CanvasRenderingContext2D.setTransform` takes it: x' = a x + c y + e, y' = b x + d y + f. */
export type Affine = readonly [a: number, b: number, c: number, d: number, e: number, f: number];

export function applyAffine([a, b, c, d, e, f]: Affine, [x, y]: Position): Position {
  return [a * x + c * y + e, b * x + d * y + f];
}

/** `compose(outer, inner)` applies `inner` first. */
export function compose(outer: Affine, inner: Affine): Affine {
  const [a, b, c, d, e, f] = outer;
  const [p, q, r, s, t, u] = inner;
  return [a * p + c * q, b * p + d * q, a * r + c * s, b * r + d * s, a * t + c * u + e, b * t + d * u + f];
}

/** From pixels of the grid's picture (its top row, the highest y, first) to the map frame, the yaw of its origin included. */
export function pixelsToMap({ resolution, height, origin: [x, y, yaw] }: Frame): Affine {
  const cos = Math.cos(yaw) * resolution;
  const sin = Math.sin(yaw) * resolution;
  return compose([cos, sin, -sin, cos, x, y], [1, 0, 0, -1, 0, height]);
}

export function frameBounds(frame: Frame): Bounds {
  const toMap = pixelsToMap(frame);
  const { width, height } = frame;
  const corners: Position[] = [
    [0, 0],
    [width, 0],
    [width, height],
    [0, height],
  ];
  return boundsOf(corners.map((corner) => applyAffine(toMap, corner)));
}

/** The box of all points; of none, an infinite empty one. */
export function boundsOf(points: Iterable<Position>): Bounds {
  let [west, south, east, north] = [Infinity, Infinity, -Infinity, -Infinity];
  for (const [x, y] of points) {
    west = Math.min(west, x);
    south = Math.min(south, y);
    east = Math.max(east, x);
    north = Math.max(north, y);
  }
  return [west, south, east, north];
}

export function isEmpty([west, south, east, north]: Bounds): boolean {
  return !(west <= east && south <= north);
}

/** Even-odd rule over all rings, so that a hole is outside. */
export function contains(rings: readonly Ring[], [x, y]: Position): boolean {
  let inside = false;
  for (const [[ax, ay], [bx, by]] of edges(rings)) {
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) inside = !inside;
  }
  return inside;
}

function* edges(rings: readonly Ring[]): Generator<readonly [Position, Position]> {
  for (const ring of rings) {
    let previous = ring.at(-1);
    for (const point of ring) {
      if (previous) yield [previous, point];
      previous = point;
    }
  }
}

/** The smallest distance between the outlines of two polygons, as far as it is below `limit`; `limit` where they lie further apart. */
export function outlineDistance(a: readonly Ring[], b: readonly Ring[], limit: number): number {
  const [west, south, east, north] = boundsOf(a.flat());
  const [w, s, e, n] = boundsOf(b.flat());
  if (w > east + limit || e < west - limit || s > north + limit || n < south - limit) return limit;
  let least = limit;
  for (const [from, ends] of [
    [a, b],
    [b, a],
  ] as const) {
    for (const point of from.flat()) {
      for (const [start, end] of edges(ends)) least = Math.min(least, distanceToSegment(point, start, end));
    }
  }
  return least;
}

function distanceToSegment([x, y]: Position, [ax, ay]: Position, [bx, by]: Position): number {
  const [dx, dy] = [bx - ax, by - ay];
  const length2 = dx * dx + dy * dy;
  const t = length2 === 0 ? 0 : Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / length2));
  return Math.hypot(x - ax - t * dx, y - ay - t * dy);
}

/** Where a label sits best, and how much room it has there: `width` along the horizontal through the point, `height` = twice the clear distance. */
export interface LabelSpot {
  readonly at: Position;
  readonly width: number;
  readonly height: number;
}

/** Labels are about this much wider than high, so the clearest point is sought with x squeezed by it. */
const LABEL_ASPECT = 2.5;
const LABEL_PRECISION_M = 0.05;

export function labelSpot(rings: readonly Ring[]): LabelSpot {
  const squeezed = rings.map((ring) => ring.map(([x, y]): [number, number] => [x / LABEL_ASPECT, y]));
  const found = polylabel(squeezed, LABEL_PRECISION_M);
  const at: Position = [(found[0] ?? 0) * LABEL_ASPECT, found[1] ?? 0];
  return { at, width: chordWidth(rings, at), height: 2 * found.distance };
}

/** The width of the polygon to both sides of a point, counted as twice the nearer side, since a label is centred. */
function chordWidth(rings: readonly Ring[], [x, y]: Position): number {
  let [left, right] = [Infinity, Infinity];
  for (const [[ax, ay], [bx, by]] of edges(rings)) {
    if (ay > y === by > y) continue;
    const crossing = ((bx - ax) * (y - ay)) / (by - ay) + ax;
    if (crossing <= x) left = Math.min(left, x - crossing);
    else right = Math.min(right, crossing - x);
  }
  const nearer = Math.min(left, right);
  return Number.isFinite(nearer) ? 2 * nearer : 0;
}

/** Doors wider than this are drawn with a leaf of this length in their middle. */
const DOOR_LEAF_M = 0.9;
const ARC_STEPS = 10;

/** The architect's mark of a door on a line: an open leaf, and the arc it swings through. */
export function doorMark(line: readonly Position[]): { readonly leaf: Position[]; readonly arc: Position[] } {
  const [start, end] = [line[0], line.at(-1)];
  if (!start || !end) return { leaf: [], arc: [] };
  const length = Math.hypot(end[0] - start[0], end[1] - start[1]);
  if (length === 0) return { leaf: [], arc: [] };
  const along: Position = [(end[0] - start[0]) / length, (end[1] - start[1]) / length];
  const leafLength = Math.min(length, DOOR_LEAF_M);
  const gap = (length - leafLength) / 2;
  const hinge: Position = [start[0] + along[0] * gap, start[1] + along[1] * gap];
  const swing = (angle: number): Position => [
    hinge[0] + leafLength * (along[0] * Math.cos(angle) - along[1] * Math.sin(angle)),
    hinge[1] + leafLength * (along[1] * Math.cos(angle) + along[0] * Math.sin(angle)),
  ];
  const arc = Array.from({ length: ARC_STEPS + 1 }, (_, step) => swing((step / ARC_STEPS) * (Math.PI / 2)));
  return { leaf: [hinge, swing(Math.PI / 2)], arc };
}
