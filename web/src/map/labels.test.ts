import { describe, expect, it } from "vitest";
import { type Label, type Measure, shownLabel } from "./labels";

const TEN_PX_A_LETTER: Measure = (text) => text.length * 10;
const label = (width: number, height: number): Label => ({
  name: "Kitchen",
  area: "12.4 m²",
  spot: { at: [0, 0], width, height },
});
const shown = (width: number, height: number, resolution = 1) =>
  shownLabel(label(width, height), resolution, TEN_PX_A_LETTER);

describe("a room's label", () => {
  it("has name and area where both fit", () => {
    expect(shown(70, 34)).toEqual({ area: true, scale: 1 });
  });

  it("leaves the area out first", () => {
    expect(shown(70, 33)).toEqual({ area: false, scale: 1 });
  });

  it("then gets smaller, and may stick out a little", () => {
    expect(shown(69, 40)).toEqual({ area: false, scale: 0.8 });
    expect(shown(41, 40)).toEqual({ area: false, scale: 0.8 });
  });

  it("is left out where the room is too small", () => {
    expect(shown(39, 40)).toBeNull();
    expect(shown(100, 9)).toBeNull();
  });

  it("comes back when one zooms in", () => {
    expect(shown(4, 2, 0.2)).toBeNull();
    expect(shown(4, 2, 0.05)).toEqual({ area: true, scale: 1 });
  });
});
