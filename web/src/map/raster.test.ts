import { expect, it } from "vitest";
import { RASTER_COLOURS, recolour } from "./raster";

it("paints free and occupied cells in the page's colours, and leaves the rest see-through", () => {
  const greys = [254, 0, 205, 128];
  const pixels = new Uint8ClampedArray(greys.flatMap((grey) => [grey, grey, grey, 255]));
  recolour(pixels, { free: [1, 2, 3], occupied: [4, 5, 6] });
  expect([...pixels]).toEqual([1, 2, 3, 255, 4, 5, 6, 255, 0, 0, 0, 0, 0, 0, 0, 0]);
});

it("paints part of a larger buffer only", () => {
  const all = new Uint8ClampedArray(12).fill(254);
  recolour(all.subarray(4, 8), RASTER_COLOURS.light);
  expect([...all]).toEqual([254, 254, 254, 254, ...RASTER_COLOURS.light.free, 255, 254, 254, 254, 254]);
});
