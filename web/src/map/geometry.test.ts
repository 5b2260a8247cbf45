import { describe, expect, it } from "vitest";
import type { Frame, Position, Ring } from "./document";
import {
  applyAffine,
  boundsOf,
  contains,
  doorMark,
  frameBounds,
  isEmpty,
  labelSpot,
  outlineDistance,
  pixelsToMap,
} from "./geometry";

const square = (west: number, south: number, side: number): Ring => [
  [west, south],
  [west + side, south],
  [west + side, south + side],
  [west, south + side],
  [west, south],
];

function expectAt([x, y]: Position, [wantX, wantY]: Position): void {
  expect(x).toBeCloseTo(wantX, 9);
  expect(y).toBeCloseTo(wantY, 9);
}

describe("from pixels to the map", () => {
  const frame: Frame = { unit: "m", resolution: 0.5, width: 4, height: 2, origin: [10, 20, 0] };

  it("puts the picture's top row at the highest y", () => {
    expectAt(applyAffine(pixelsToMap(frame), [0, 0]), [10, 21]);
    expectAt(applyAffine(pixelsToMap(frame), [0, 2]), [10, 20]);
    expectAt(applyAffine(pixelsToMap(frame), [4, 2]), [12, 20]);
  });

  it("turns the picture about its lower-left corner by the origin's yaw", () => {
    const turned: Frame = { ...frame, origin: [10, 20, Math.PI / 2] };
    expectAt(applyAffine(pixelsToMap(turned), [0, 2]), [10, 20]);
    expectAt(applyAffine(pixelsToMap(turned), [4, 2]), [10, 22]);
    expectAt(applyAffine(pixelsToMap(turned), [0, 0]), [9, 20]);
    const [west, south, east, north] = frameBounds(turned);
    expectAt([west, south], [9, 20]);
    expectAt([east, north], [10, 22]);
  });
});

describe("bounds", () => {
  it("of nothing are empty", () => {
    expect(isEmpty(boundsOf([]))).toBe(true);
    expect(isEmpty(boundsOf([[1, 1]]))).toBe(false);
  });
});

describe("a polygon", () => {
  const ring = [square(0, 0, 10), square(4, 4, 2)];

  it("contains what is within its outline, but not what is in its holes", () => {
    expect(contains(ring, [1, 1])).toBe(true);
    expect(contains(ring, [5, 5])).toBe(false);
    expect(contains(ring, [11, 5])).toBe(false);
  });

  it("is as far from another as their nearest edges, and never further than is asked", () => {
    expect(outlineDistance([square(0, 0, 1)], [square(1.25, 0.5, 3)], 1)).toBeCloseTo(0.25);
    expect(outlineDistance([square(0, 0, 1)], [square(9, 9, 1)], 1)).toBe(1);
  });
});

describe("the spot for a label", () => {
  // An L: a tall narrow leg, and a wide low one.
  const el: Ring = [
    [0, 0],
    [6, 0],
    [6, 2],
    [1.5, 2],
    [1.5, 8],
    [0, 8],
    [0, 0],
  ];

  it("lies inside, in the part that is wide", () => {
    const { at, width, height } = labelSpot([el]);
    expect(contains([el], at)).toBe(true);
    expect(at[0]).toBeGreaterThan(1.5);
    expect(at[1]).toBeLessThan(2);
    expect(width).toBeGreaterThan(3);
    expect(height).toBeLessThanOrEqual(2.01);
  });

  it("has the width to the nearer side, as the label is centred", () => {
    const { at, width } = labelSpot([square(0, 0, 4)]);
    expectAt([Math.round(at[0] * 10) / 10, width], [2, 4]);
  });

  it("avoids holes", () => {
    const ring = [square(0, 0, 10), square(3, 3, 4)];
    expect(contains(ring, labelSpot(ring).at)).toBe(true);
  });
});

describe("the mark of a door", () => {
  it("is a leaf at right angles to the line and a quarter circle, both of the door's width", () => {
    const { leaf, arc } = doorMark([
      [0, 0],
      [0.8, 0],
    ]);
    expectAt(leaf[0] ?? [9, 9], [0, 0]);
    expectAt(leaf[1] ?? [9, 9], [0, 0.8]);
    expectAt(arc[0] ?? [9, 9], [0.8, 0]);
    expectAt(arc.at(-1) ?? [9, 9], [0, 0.8]);
    for (const [x, y] of arc) expect(Math.hypot(x, y)).toBeCloseTo(0.8);
  });

  it("stands in the middle of a wide opening", () => {
    const { leaf } = doorMark([
      [0, 0],
      [0, 3],
    ]);
    expectAt(leaf[0] ?? [9, 9], [0, 1.05]);
    expectAt(leaf[1] ?? [9, 9], [-0.9, 1.05]);
  });

  it("is nothing on a line of no length", () => {
    expect(
      doorMark([
        [1, 1],
        [1, 1],
      ]),
    ).toEqual({ leaf: [], arc: [] });
  });
});
