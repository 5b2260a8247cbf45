import { describe, expect, it } from "vitest";
import { axisEnd, compared, interval, percent } from "./figures";

describe("figures", () => {
  it("are percents with one digit, with their interval", () => {
    expect(percent(0.1234)).toBe("12.3\u202f%");
    expect(interval([0.0052, 0.1])).toBe("0.5 to 10.0\u00a0%");
  });

  it("differ only where their intervals lie apart", () => {
    expect(compared([0.2, 0.3], [0.1, 0.19])).toBe("higher");
    expect(compared([0.0, 0.09], [0.1, 0.19])).toBe("lower");
    expect(compared([0.1, 0.3], [0.05, 0.2])).toBe("same");
    expect(compared([0.1, 0.2], [0.2, 0.3])).toBe("same");
  });

  it("fit on an axis that ends at a round share", () => {
    expect(axisEnd([0.11, 0.031])).toBe(0.15);
    expect(axisEnd([])).toBe(0.02);
    expect(axisEnd([1])).toBe(1);
  });
});
