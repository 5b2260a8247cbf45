import { describe, expect, it } from "vitest";
import { HOME } from "../map/fixtures/home";
import { viewMap } from "../map/view";
import { changedPlaces, type Difference, focusOn } from "./changes";

const VIEW = viewMap(HOME);
const [FIRST, SECOND] = VIEW.rooms;

function at(change: Difference["change"], [x, y]: readonly [number, number], area: number): Difference {
  const ring: [number, number][] = [
    [x, y],
    [x + 0.01, y],
    [x + 0.01, y + 0.01],
    [x, y],
  ];
  return { change, area, geometry: { type: "Polygon", coordinates: [ring] } };
}

describe("places that changed", () => {
  it("are told by room, what is asked about first and the larger ones before the smaller", () => {
    if (!FIRST || !SECOND) throw new Error("a home of two rooms at least");
    const found = changedPlaces(
      [
        at("unseen", SECOND.label.at, 9),
        at("blocked", FIRST.label.at, 0.5),
        at("blocked", FIRST.label.at, 0.25),
        at("found", [999, 999], 3),
      ],
      VIEW,
      [FIRST.id],
    );
    expect(found.map(({ change, room, area }) => [change, room?.id ?? null, area])).toEqual([
      ["blocked", FIRST.id, 0.75],
      ["unseen", SECOND.id, 9],
      ["found", null, 3],
    ]);
  });
});

describe("what to look at", () => {
  it("has room around it, and is never so small that nobody knows where it is", () => {
    expect(focusOn([[1, 1]])).toEqual([-0.5, -0.5, 2.5, 2.5]);
    expect(
      focusOn([
        [0, 0],
        [10, 8],
      ]),
    ).toEqual([-0.6, -0.6, 10.6, 8.6]);
    expect(focusOn([])).toBeNull();
  });
});
