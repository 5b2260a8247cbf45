import fc from "fast-check";
import { describe, expect, it } from "vitest";
import type { Position, Ring } from "./document";
import type { Line } from "./operations";
import { attach, gap, snap } from "./snap";
import { areaOf, splitRoom } from "./split";

const box = (west: number, south: number, east: number, north: number): Ring => [
  [west, south],
  [east, south],
  [east, north],
  [west, north],
  [west, south],
];
const edges = (ring: Ring): Line[] => ring.slice(1).map((point, i) => [ring[i] ?? point, point]);
const areas = (rings: readonly Ring[], line: Line) => splitRoom(rings, line).map(areaOf);

describe("rooms-to-be", () => {
  it("are the parts of the room on both sides of the line, however it is drawn", () => {
    const part = fc.double({ min: 0.05, max: 0.95, noNaN: true });
    fc.assert(
      fc.property(part, part, fc.boolean(), (a, b, turned) => {
        const line: Line = [
          [8 * a, 0],
          [8 * b, 4],
        ];
        const drawn: Line = turned ? [line[1], line[0]] : line;
        const found = areas([box(0, 0, 8, 4)], drawn);
        expect(found).toHaveLength(2);
        const left = (8 * a + 8 * b) * 2;
        expect([...found].sort((x, y) => x - y)[0]).toBeCloseTo(Math.min(left, 32 - left), 6);
        expect(found.reduce((sum, one) => sum + one, 0)).toBeCloseTo(32, 6);
      }),
    );
  });

  it("are more than two where the line runs through a corner that sticks in", () => {
    const u: Ring = [
      [0, 0],
      [6, 0],
      [6, 4],
      [4, 4],
      [4, 1],
      [2, 1],
      [2, 4],
      [0, 4],
      [0, 0],
    ];
    const found = areas(
      [u],
      [
        [0, 3],
        [6, 3],
      ],
    );
    expect([...found].sort((a, b) => a - b).map((size) => Math.round(size * 100) / 100)).toEqual([2, 2, 14]);
  });

  it("keep their pillars", () => {
    const parts = splitRoom(
      [box(0, 0, 8, 4), box(1, 1, 2, 2)],
      [
        [4, 0],
        [4, 4],
      ],
    );
    expect(parts.map(areaOf).sort((a, b) => a - b)).toEqual([15, 16]);
    expect(parts.map((rings) => rings.length).sort()).toEqual([1, 2]);
  });

  it("are the room itself where the line does not part it", () => {
    expect(
      areas(
        [box(0, 0, 8, 4)],
        [
          [4, 0],
          [4, 2],
        ],
      ),
    ).toEqual([32]);
    expect(
      areas(
        [box(0, 0, 8, 4)],
        [
          [9, 0],
          [9, 4],
        ],
      ),
    ).toEqual([32]);
    expect(
      areas(
        [box(0, 0, 8, 4)],
        [
          [0, 0],
          [8, 0],
        ],
      ),
    ).toEqual([32]);
    expect(
      areas(
        [box(0, 0, 8, 4)],
        [
          [3, 3],
          [3, 3],
        ],
      ),
    ).toEqual([32]);
  });
});

describe("snapping", () => {
  const walls = edges(box(0, 0, 8, 4));

  it("moves a point onto what is near, corners first, and leaves any other where it is", () => {
    expect(snap([3, 0.2], walls, 0.5)).toEqual({ at: [3, 0], onto: "edge" });
    expect(snap([0.1, 0.1], walls, 0.5)).toEqual({ at: [0, 0], onto: "corner" });
    expect(snap([4, 2], walls, 0.5)).toEqual({ at: [4, 2], onto: null });
    expect(snap([4, 2], [], 0.5)).toEqual({ at: [4, 2], onto: null });
  });

  it("never moves a point farther than its reach", () => {
    const place = fc.double({ min: -2, max: 10, noNaN: true });
    fc.assert(
      fc.property(place, place, fc.double({ min: 0.01, max: 2, noNaN: true }), (x, y, reach) => {
        const { at, onto } = snap([x, y], walls, reach);
        expect(gap(at, [x, y])).toBeLessThanOrEqual(reach);
        if (onto === null) expect(at).toEqual([x, y]);
        else expect(snap(at, walls, 0.01).onto).not.toBeNull();
      }),
    );
  });

  it("draws both ends of a divider to the walls along its own line", () => {
    const found = attach(
      [
        [2, 0.4],
        [2.1, 4.3],
      ],
      walls,
    );
    if (!found.ok) throw new Error("refused");
    expect(found.line[0][1]).toBeCloseTo(0, 9);
    expect(found.line[1][1]).toBeCloseTo(4, 9);
    expect(found.line[0][0]).toBeCloseTo(2 - (0.1 * 0.4) / 3.9, 9);
  });

  it("refuses an end in mid-air, says how far it is, and what would do", () => {
    const found = attach(
      [
        [2, 0],
        [2, 2.5],
      ],
      walls,
    );
    expect(found).toMatchObject({ ok: false, end: 1, gap: 1.5 });
    if (found.ok || !found.extended) throw new Error("no fix");
    const expected: Position[] = [
      [2, 0],
      [2, 4],
    ];
    for (const [i, point] of found.extended.entries()) expect(gap(point, expected[i] ?? [9, 9])).toBeLessThan(1e-9);
    expect(attach(found.extended, walls).ok).toBe(true);
    expect(
      attach(
        [
          [20, 0],
          [21, 3],
        ],
        walls,
      ),
    ).toMatchObject({ ok: false, extended: null });
    expect(
      attach(
        [
          [2, 2],
          [2, 2],
        ],
        walls,
      ),
    ).toMatchObject({ ok: false });
  });
});
