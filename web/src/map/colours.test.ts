import { describe, expect, it } from "vitest";
import { type Colourable, colourRooms, ROOM_FILLS, SLOTS } from "./colours";

const room = (segmentId: number, ...beside: number[]): Colourable => ({
  id: `r${segmentId}`,
  segmentId,
  beside: beside.map((n) => `r${n}`),
});

describe("colours of rooms", () => {
  it("are all different in a home of no more rooms than there are colours", () => {
    const rooms = Array.from({ length: SLOTS }, (_, i) => room(i + 1));
    expect(new Set(colourRooms(rooms).values()).size).toBe(SLOTS);
  });

  it("differ between neighbours", () => {
    const slots = colourRooms([room(1, 1 + SLOTS), room(1 + SLOTS, 1, 2), room(2, 1 + SLOTS)]);
    expect(slots.get("r9")).not.toBe(slots.get("r1"));
    expect(slots.get("r9")).not.toBe(slots.get("r2"));
  });

  it("of rooms that were there stay when a room is added, and do not depend on the order", () => {
    const before = colourRooms([room(1), room(2, 3), room(3, 2)]);
    const after = colourRooms([room(11, 1, 2, 3), room(3, 2, 11), room(2, 3, 11), room(1, 11)]);
    for (const [id, slot] of before) expect(after.get(id)).toBe(slot);
  });

  it("repeat rather than fail where every colour is taken by a neighbour", () => {
    const others = Array.from({ length: SLOTS }, (_, i) => i + 1);
    const slots = colourRooms([...others.map((n) => room(n)), room(SLOTS + 1, ...others)]);
    expect(slots.get(`r${SLOTS + 1}`)).toBe(0);
  });
});

type Rgb = readonly [number, number, number];
type Matrix = readonly [Rgb, Rgb, Rgb];

/** Machado, Oliveira, Fernandes 2009, severity 1, on linear RGB. */
const SIGHTS: Readonly<Record<string, Matrix>> = {
  normal: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  protan: [
    [0.152286, 1.052583, -0.204868],
    [0.114503, 0.786281, 0.099216],
    [-0.003882, -0.048116, 1.051998],
  ],
  deutan: [
    [0.367322, 0.860646, -0.227968],
    [0.280085, 0.672501, 0.047413],
    [-0.01182, 0.04294, 0.968881],
  ],
  tritan: [
    [1.255528, -0.076749, -0.178779],
    [-0.078411, 0.930809, 0.147602],
    [0.004733, 0.691367, 0.3039],
  ],
};
const TO_XYZ: Matrix = [
  [0.4124, 0.3576, 0.1805],
  [0.2126, 0.7152, 0.0722],
  [0.0193, 0.1192, 0.9505],
];
const WHITE: Rgb = [0.9505, 1, 1.089];

function times(matrix: Matrix, [x, y, z]: Rgb): Rgb {
  const [a, b, c] = matrix.map(([p, q, r]) => p * x + q * y + r * z);
  return [a ?? 0, b ?? 0, c ?? 0];
}

function lab(hex: string, sight: Matrix): Rgb {
  const [r = 0, g = 0, b = 0] = [1, 3, 5].map((i) => {
    const channel = Number.parseInt(hex.slice(i, i + 2), 16) / 255;
    return channel <= 0.04045 ? channel / 12.92 : ((channel + 0.055) / 1.055) ** 2.4;
  });
  const seen = times(sight, [r, g, b]).map((channel) => Math.min(1, Math.max(0, channel)));
  const xyz = times(TO_XYZ, [seen[0] ?? 0, seen[1] ?? 0, seen[2] ?? 0]);
  const [x = 0, y = 0, z = 0] = xyz.map((value, i) => {
    const t = value / (WHITE[i] ?? 1);
    return t > 0.008856 ? Math.cbrt(t) : 7.787 * t + 16 / 116;
  });
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

describe.each(Object.entries(ROOM_FILLS))("the %s palette", (_, fills) => {
  it.each(Object.entries(SIGHTS))("can be told apart with %s sight", (_name, sight) => {
    expect(fills).toHaveLength(SLOTS);
    const seen = fills.map((hex) => lab(hex, sight));
    for (const [i, a] of seen.entries()) {
      for (const b of seen.slice(i + 1)) {
        expect(Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2])).toBeGreaterThan(14);
      }
    }
  });
});
