/** What of a map can be selected, snapped to and moved: pure, in metres. */

import type { MapDocument, Position, Ring } from "../map/document";
import { contains } from "../map/geometry";
import type { Line } from "../map/operations";
import { gap, nearestOn, type Segment } from "../map/snap";

export type Selection = {
  readonly sort: "room" | "divider" | "restriction" | "phantom" | "meta_divider";
  readonly id: string;
} | null;

export type Tool = "select" | "divider" | "no_go" | "no_mop" | "virtual_wall" | "phantom";
export const DRAWING_TOOLS = ["divider", "no_go", "no_mop", "virtual_wall", "phantom"] as const;

/** Whether the tool draws from end to end; the others draw from corner to corner. */
export const drawsLine = (tool: Tool): boolean => tool === "divider" || tool === "virtual_wall";

/** Everything that a divider may end on, but for itself. */
export function barriers(document: MapDocument, except?: string): Segment[] {
  return document.features.flatMap((feature) => {
    const { semantic } = feature.properties;
    const isBarrier = semantic === "wall" || semantic === "divider" || semantic === "meta_divider";
    return isBarrier && feature.id !== except ? segmentsOf(feature.geometry.coordinates as Position[]) : [];
  });
}

function segmentsOf(points: readonly Position[]): Segment[] {
  return points.slice(1).map((point, i) => [points[i] ?? point, point] as const);
}

export function rectangle([ax, ay]: Position, [bx, by]: Position): Position[] {
  const [west, east] = [Math.min(ax, bx), Math.max(ax, bx)];
  const [south, north] = [Math.min(ay, by), Math.max(ay, by)];
  return [
    [west, south],
    [east, south],
    [east, north],
    [west, north],
  ];
}

export type ShapeChange = (shape: readonly Position[]) => readonly Position[];

/** The points of what can be moved: a line's ends, or a ring's corners. */
export function shapeOf(document: MapDocument, selection: Selection): readonly Position[] | null {
  const feature = selection && document.features.find(({ id }) => id === selection.id);
  if (!feature || !["divider", "restriction"].includes(feature.properties.semantic)) return null;
  const { geometry } = feature;
  if (geometry.type === "LineString") return geometry.coordinates;
  return (geometry.coordinates[0] ?? []).slice(0, -1);
}

export const shifted = (points: readonly Position[], [dx, dy]: Position): Position[] =>
  points.map(([x, y]) => [x + dx, y + dy]);

/** About the middle of the points. */
export function turned(points: readonly Position[], angle: number): Position[] {
  const [cx, cy] = middle(points);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return points.map(([x, y]) => [cx + c * (x - cx) - s * (y - cy), cy + s * (x - cx) + c * (y - cy)]);
}

/** Wider by so many metres in all, about the middle. */
export function grown(points: readonly Position[], metres: number): Position[] {
  const [cx, cy] = middle(points);
  const [width, height] = [0, 1].map((k) => {
    const values = points.map((point) => point[k as 0 | 1]);
    return Math.max(...values) - Math.min(...values);
  }) as [number, number];
  const factor = (size: number) => (size > 0 ? Math.max(0.1, size + metres) / size : 1);
  return points.map(([x, y]) => [cx + (x - cx) * factor(width), cy + (y - cy) * factor(height)]);
}

export function middle(points: readonly Position[]): Position {
  const sum = points.reduce<Position>(([x, y], [u, v]) => [x + u, y + v], [0, 0]);
  return [sum[0] / points.length, sum[1] / points.length];
}

const ORDER = ["divider", "meta_divider", "restriction", "phantom", "room"] as const;

/** What a finger at a point means: lines within `reach` metres first, then what it lies in, the smallest first. */
export function pick(document: MapDocument, point: Position, reach: number): Selection {
  const hits: { sort: (typeof ORDER)[number]; id: string; rank: number }[] = [];
  for (const { id, geometry, properties } of document.features) {
    const sort = ORDER.find((one) => one === properties.semantic);
    if (!sort) continue;
    if (geometry.type === "LineString") {
      const near = Math.min(
        ...segmentsOf(geometry.coordinates).map((segment) => gap(point, nearestOn(segment, point))),
      );
      if (near <= reach) hits.push({ sort, id, rank: near / reach });
    } else if (contains(geometry.coordinates, point)) {
      hits.push({ sort, id, rank: 1 + ORDER.indexOf(sort) + extent(geometry.coordinates) / 1e6 });
    }
  }
  const [best] = hits.sort((a, b) => a.rank - b.rank);
  return best ? { sort: best.sort, id: best.id } : null;
}

function extent(rings: readonly Ring[]): number {
  const points = rings[0] ?? [];
  const [xs, ys] = [points.map(([x]) => x), points.map(([, y]) => y)];
  return (Math.max(...xs) - Math.min(...xs)) * (Math.max(...ys) - Math.min(...ys));
}

/** A line across a room, at a share of its length: for those who would rather not point. */
export function chordAcross(rings: readonly Ring[], direction: "upright" | "level", share: number): Line | null {
  const points = rings.flat();
  const k: 0 | 1 = direction === "upright" ? 0 : 1;
  const other: 0 | 1 = direction === "upright" ? 1 : 0;
  const [low, high] = [Math.min(...points.map((p) => p[k])), Math.max(...points.map((p) => p[k]))];
  const at = low + (high - low) * share;
  const crossings: number[] = [];
  for (const ring of rings) {
    for (const [i, b] of ring.slice(1).entries()) {
      const a = ring[i] ?? b;
      if (a[k] > at === b[k] > at) continue;
      crossings.push(a[other] + ((b[other] - a[other]) * (at - a[k])) / (b[k] - a[k]));
    }
  }
  crossings.sort((a, b) => a - b);
  let best: Line | null = null;
  for (let i = 0; i + 1 < crossings.length; i += 2) {
    const [from, to] = [crossings[i] ?? 0, crossings[i + 1] ?? 0];
    const line: Line =
      k === 0
        ? [
            [at, from],
            [at, to],
          ]
        : [
            [from, at],
            [to, at],
          ];
    if (!best || gap(...line) > gap(...best)) best = line;
  }
  return best;
}
