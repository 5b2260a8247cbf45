import { describe, expect, it } from "vitest";
import { floorKey } from "./floors";

describe("a new floor's key", () => {
  it("is what its name reads like in plain letters", () => {
    expect(floorKey("Upstairs", [])).toBe("upstairs");
    expect(floorKey("  Étage d'en haut! ", [])).toBe("etage-d-en-haut");
  });

  it("is never one that another floor has", () => {
    expect(floorKey("Attic", ["attic"])).toBe("attic-2");
    expect(floorKey("Attic", ["attic", "attic-2"])).toBe("attic-3");
  });

  it("is there for names without any plain letter, and no longer than the API allows", () => {
    expect(floorKey("上の階", [])).toBe("floor");
    expect(floorKey("x".repeat(200), [])).toMatch(/^x{1,64}$/);
  });
});
