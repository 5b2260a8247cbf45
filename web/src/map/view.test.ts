import { describe, expect, it } from "vitest";
import { HOME } from "./fixtures/home";
import { roomAt, viewMap } from "./view";

const view = viewMap(HOME);
const find = (id: string) => view.rooms.find((room) => room.id === id);

describe("a map's view", () => {
  it("lists rooms by name, as people sort", () => {
    const renamed = {
      ...HOME,
      features: HOME.features.map((feature) =>
        feature.properties.semantic === "room"
          ? { ...feature, properties: { ...feature.properties, name: `Room ${feature.properties.segment_id}` } }
          : feature,
      ) as typeof HOME.features,
    };
    expect(viewMap(renamed).rooms.map(({ name }) => name)).toEqual(["Room 1", "Room 2", "Room 10"]);
  });

  it("names the neighbours behind dividers, doors and repairs, and only rooms that exist", () => {
    expect(find("r2")?.neighbours).toEqual([
      { id: "r10", name: "Hall", passages: ["meta"] },
      { id: "r1", name: "Kitchen", passages: ["door"] },
    ]);
    expect(find("r10")?.neighbours.map(({ passages }) => passages)).toEqual([["meta"], ["open"]]);
  });

  it("gives rooms that lie side by side different colours, also with only a wall between", () => {
    expect(new Set(view.rooms.map(({ slot }) => slot)).size).toBe(3);
  });

  it("is as large as its rooms and walls, and as the grid where there are none", () => {
    expect(view.bounds).toEqual([-0.1, -1.5, 8, 3]);
    expect(viewMap({ ...HOME, features: [] }).bounds).toEqual([-1, -2, 9, 4]);
  });

  it("keeps every other thing in its own list", () => {
    const { dividers, walls, clutter, metaDividers, metaOccupancy, restrictions } = view;
    const ids = [dividers, walls, clutter, metaDividers, metaOccupancy, restrictions].map((list) =>
      list.map(({ id }) => id),
    );
    expect(ids).toEqual([["d1", "d2"], ["w1"], ["k1"], ["m1"], ["o1"], ["z1"]]);
  });

  it("adds up the rooms' areas", () => {
    expect(view.area).toBeCloseTo(34.91);
  });
});

describe("the room at a point", () => {
  it("is the one that contains it", () => {
    expect(roomAt(view, [1, 1])?.id).toBe("r1");
    expect(roomAt(view, [1, -1])?.id).toBe("r10");
    expect(roomAt(view, [-0.05, 1])).toBeUndefined();
  });
});
