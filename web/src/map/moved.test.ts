import fc from "fast-check";
import { describe, expect, it } from "vitest";
import { HOME as home } from "./fixtures/home";
import { frameBounds } from "./geometry";
import { movedDocument, type Pose } from "./moved";
import { viewMap } from "./view";

const metres = fc.double({ min: -50, max: 50, noNaN: true });
const pose = fc.tuple(metres, metres, fc.double({ min: -3, max: 3, noNaN: true }));

describe("a document in another frame", () => {
  it("stays where it is by no motion", () => {
    expect(movedDocument(home, [0, 0, 0])).toEqual(home);
  });

  it("keeps every area and the grid under its rooms", () => {
    fc.assert(
      fc.property(pose, (by: Pose) => {
        const before = viewMap(home);
        const moved = movedDocument(home, by);
        const after = viewMap(moved);
        expect(after.rooms.map(({ area }) => area)).toEqual(before.rooms.map(({ area }) => area));
        const [west, south] = frameBounds(moved.frame);
        for (const [x, y] of after.rooms.flatMap(({ rings }) => rings.flat())) {
          expect(x).toBeGreaterThan(west - 1e-6);
          expect(y).toBeGreaterThan(south - 1e-6);
        }
      }),
    );
  });

  it("is moved by shift and turn", () => {
    const moved = movedDocument(home, [1, 2, Math.PI / 2]);
    const [ox, oy, turn] = home.frame.origin;
    const [x, y, yaw] = moved.frame.origin;
    expect(x).toBeCloseTo(1 - oy, 9);
    expect(y).toBeCloseTo(2 + ox, 9);
    expect(yaw).toBeCloseTo(turn + Math.PI / 2, 9);
  });
});
