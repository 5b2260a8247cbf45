import { describe, expect, it } from "vitest";
import { extentOf, pathOf, type Shape } from "./plan";
import type { Figure } from "./queries";

const SQUARE = {
  type: "Polygon",
  coordinates: [
    [
      [0, 0],
      [4, 0],
      [4, 3],
      [0, 0],
    ],
  ],
} as const;

const figure = (candidate: readonly unknown[]): Figure =>
  ({
    frame: { unit: "m", resolution: 0.5, width: 20, height: 10, origin: [-1, -2, 0] },
    candidate,
    tracked: [],
  }) as unknown as Figure;

describe("a floor plan", () => {
  it("draws polygons closed and lines open", () => {
    expect(pathOf(SQUARE as unknown as Shape["geometry"])).toBe("M0 0L4 0L4 3L0 0Z");
    expect(
      pathOf({
        type: "LineString",
        coordinates: [
          [0.12345, 0],
          [1, 1],
        ],
      } as Shape["geometry"]),
    ).toBe("M0.123 0L1 1");
  });

  it("shows what was judged with a margin, or else all of the grid", () => {
    expect(extentOf(figure([{ geometry: SQUARE }]))).toEqual({ x: -0.5, y: -0.5, width: 5, height: 4 });
    expect(extentOf(figure([]))).toEqual({ x: -1.5, y: -2.5, width: 11, height: 6 });
  });
});
