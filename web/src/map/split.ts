/** Rooms-to-be: what a divider would make of a room, worked out at once, before the service has its say. */

import type { Position, Ring } from "./document";
import { contains } from "./geometry";
import type { Line } from "./operations";

const ON_M = 0.012;

/** The parts of a polygon (closed rings, exterior first) on both sides of a line; the polygon alone where the line does not part it. */
export function splitRoom(rings: readonly Ring[], line: Line): readonly (readonly Ring[])[] {
  const [exterior, ...holes] = rings;
  if (!exterior) return [rings];
  let parts: Ring[] = [open(exterior)];
  for (const chord of chordsInside(rings, line)) {
    parts = parts.flatMap((part) => cutRing(part, chord));
  }
  if (parts.length < 2) return [rings];
  return parts.map((part) => {
    const ring = closed(part);
    return [ring, ...holes.filter((hole) => hole[0] && contains([ring], hole[0]))];
  });
}

/** In square metres; holes are taken off. */
export function areaOf([exterior, ...holes]: readonly Ring[]): number {
  const size = (ring: Ring) => Math.abs(signedArea(ring));
  return exterior ? size(exterior) - holes.reduce((sum, hole) => sum + size(hole), 0) : 0;
}

function signedArea(ring: Ring): number {
  let sum = 0;
  let previous = ring.at(-1);
  for (const point of ring) {
    if (previous) sum += previous[0] * point[1] - point[0] * previous[1];
    previous = point;
  }
  return sum / 2;
}

/** The pieces of the line that run through the polygon from one place of its exterior to another. */
function chordsInside(rings: readonly Ring[], line: Line): Line[] {
  const [a, b] = line;
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  if (length === 0) return [];
  const at = (t: number): Position => [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];
  const slack = ON_M / length;
  const stops = new Set<number>([0, 1]);
  for (const ring of rings) {
    const points = open(ring);
    points.forEach((p, i) => {
      const q = points[(i + 1) % points.length];
      if (!q) return;
      const t = crossing(a, b, p, q);
      if (t !== null && t > -slack && t < 1 + slack) stops.add(Math.min(1, Math.max(0, t)));
      for (const corner of [p, q]) {
        const s = ((corner[0] - a[0]) * (b[0] - a[0]) + (corner[1] - a[1]) * (b[1] - a[1])) / length ** 2;
        const off = at(s);
        if (s > 0 && s < 1 && Math.hypot(corner[0] - off[0], corner[1] - off[1]) < ON_M / 4) stops.add(s);
      }
    });
  }
  const sorted = [...stops].sort((x, y) => x - y);
  return sorted.slice(1).flatMap((t, i) => {
    const s = sorted[i] ?? 0;
    return (t - s) * length > ON_M && contains(rings, at((s + t) / 2)) ? [[at(s), at(t)] as const] : [];
  });
}

function crossing(a: Position, b: Position, p: Position, q: Position): number | null {
  const [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], q[0] - p[0], q[1] - p[1]];
  const cross = ux * vy - uy * vx;
  if (Math.abs(cross) < 1e-12) return null;
  const [wx, wy] = [p[0] - a[0], p[1] - a[1]];
  const t = (wx * vy - wy * vx) / cross;
  const s = (wx * uy - wy * ux) / cross;
  return s >= -1e-9 && s <= 1 + 1e-9 ? t : null;
}

/** Both sides of an open ring along a chord whose ends lie on it; the ring alone where they don't. */
function cutRing(ring: Ring, [from, to]: Line): Ring[] {
  const i = edgeAt(ring, from);
  const j = edgeAt(ring, to);
  if (i === null || j === null) return [ring];
  const one = walk(ring, i, from, j, to);
  const other = walk(ring, j, to, i, from);
  return one && other && one.length > 2 && other.length > 2 ? [one, other] : [ring];
}

/** The index of the edge on which a point lies. */
function edgeAt(ring: Ring, [x, y]: Position): number | null {
  let best: number | null = null;
  let least = ON_M;
  ring.forEach(([ax, ay], i) => {
    const [bx, by] = ring[(i + 1) % ring.length] ?? [ax, ay];
    const [dx, dy] = [bx - ax, by - ay];
    const length2 = dx * dx + dy * dy;
    const t = length2 === 0 ? 0 : Math.min(1, Math.max(0, ((x - ax) * dx + (y - ay) * dy) / length2));
    const distance = Math.hypot(x - ax - t * dx, y - ay - t * dy);
    if (distance < least) [best, least] = [i, distance];
  });
  return best;
}

/** Along the ring from a point on edge `i` to one on edge `j`, both included. */
function walk(ring: Ring, i: number, from: Position, j: number, to: Position): Ring | null {
  const forward = (k: number, point: Position): number => {
    const corner = ring[k] ?? point;
    return Math.hypot(point[0] - corner[0], point[1] - corner[1]);
  };
  const points: Position[] = [from];
  if (i !== j || forward(i, to) < forward(i, from)) {
    let k = i;
    for (let steps = 0; steps <= ring.length; steps++) {
      k = (k + 1) % ring.length;
      const corner = ring[k];
      if (corner) points.push(corner);
      if (k === j) break;
    }
  }
  points.push(to);
  return points.filter(
    (point, n) =>
      n === 0 || Math.hypot(point[0] - (points[n - 1]?.[0] ?? 0), point[1] - (points[n - 1]?.[1] ?? 0)) > 1e-9,
  );
}

function open(ring: Ring): Ring {
  const [first, last] = [ring[0], ring.at(-1)];
  return first && last && first[0] === last[0] && first[1] === last[1] ? ring.slice(0, -1) : ring;
}

const closed = (ring: Ring): Ring => (ring[0] ? [...ring, ring[0]] : ring);
