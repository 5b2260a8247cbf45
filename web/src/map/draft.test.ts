import fc from "fast-check";
import { describe, expect, it } from "vitest";
import {
  type Draft,
  discarded,
  done,
  emptyDraft,
  isDirty,
  parseDraft,
  redone,
  redoStep,
  saved,
  undone,
  undoStep,
  versionRedone,
  versionUndone,
} from "./draft";
import * as edits from "./operations";

const coordinate = fc.integer({ min: -5000, max: 5000 }).map((mm) => mm / 1000);
const point = fc.tuple(coordinate, coordinate);
const line = fc.tuple(point, point);
const shape = fc.array(point, { minLength: 3, maxLength: 6 });
const id = fc.constantFrom("r1", "r2", "d1", "d2", "z1");
const ref = fc.oneof(
  id.map((name): edits.Ref => ({ id: name })),
  fc.nat(4).map((index): edits.Ref => ({ index })),
);
const room = fc.oneof(
  id.map((name): edits.RoomRef => ({ id: name })),
  point.map((at): edits.RoomRef => ({ at })),
);
type Action = (before: edits.Operations) => edits.Operations;
const action: fc.Arbitrary<Action> = fc.oneof(
  line.map(
    (l): Action =>
      (before) =>
        edits.addDivider(before, l),
  ),
  fc.tuple(ref, line).map(
    ([r, l]): Action =>
      (before) =>
        edits.moveDivider(before, r, l),
  ),
  ref.map(
    (r): Action =>
      (before) =>
        edits.removeDivider(before, r),
  ),
  ref.map(
    (r): Action =>
      (before) =>
        edits.setDividerKind(before, r, "door"),
  ),
  fc.tuple(room, fc.string()).map(
    ([r, name]): Action =>
      (before) =>
        edits.renameRoom(before, r, name),
  ),
  room.map(
    (r): Action =>
      (before) =>
        edits.setRoomKind(before, r, "kitchen"),
  ),
  fc.tuple(room, fc.boolean()).map(
    ([r, pinned]): Action =>
      (before) =>
        edits.pinRoom(before, r, pinned),
  ),
  fc.constant<Action>((before) => edits.mergeRooms(before, ["r1", "r2"])),
  shape.map(
    (s): Action =>
      (before) =>
        edits.addRestriction(before, "no_go", s),
  ),
  fc.tuple(ref, shape).map(
    ([r, s]): Action =>
      (before) =>
        edits.moveRestriction(before, r, s),
  ),
  ref.map(
    (r): Action =>
      (before) =>
        edits.removeRestriction(before, r),
  ),
  shape.map(
    (s): Action =>
      (before) =>
        edits.markPhantom(before, s),
  ),
  ref.map(
    (r): Action =>
      (before) =>
        edits.removePhantom(before, r),
  ),
);
const walk = fc.array(action, { maxLength: 12 });

function walked(actions: readonly Action[]): Draft {
  return actions.reduce((draft, act) => done(draft, act(draft.present.operations)), emptyDraft(7));
}

function times<T>(n: number, step: (value: T) => T, value: T): T {
  return n === 0 ? value : times(n - 1, step, step(value));
}

describe("undo and redo", () => {
  it("undo of do is as if nothing was done, and redo of undo as if nothing was undone", () => {
    fc.assert(
      fc.property(walk, action, (actions, act) => {
        const before = walked(actions);
        const after = done(before, act(before.present.operations));
        if (after === before) return;
        expect(undone(after).present).toEqual(before.present);
        expect(redone(undone(after)).present).toEqual(after.present);
      }),
    );
  });

  it("leads all the way back to the beginning and forth again", () => {
    fc.assert(
      fc.property(walk, (actions) => {
        const draft = walked(actions);
        const start = times(draft.past.length, undone, draft);
        expect(start.present).toEqual({ base: 7, operations: [] });
        expect(undoStep(start)).toBeNull();
        expect(times(draft.past.length, redone, start).present).toEqual(draft.present);
      }),
    );
  });

  it("forgets what was undone as soon as something else is done", () => {
    const draft = undone(walked([(before) => edits.mergeRooms(before, ["r1", "r2"])]));
    expect(redoStep(draft)).toEqual({ kind: "draft" });
    expect(
      redoStep(
        done(
          draft,
          edits.addDivider(
            [],
            [
              [0, 0],
              [1, 1],
            ],
          ),
        ),
      ),
    ).toBeNull();
  });

  it("goes on through saved versions, and back through what took them back", () => {
    const once = saved(walked([(before) => edits.mergeRooms(before, ["r1", "r2"])]), 8);
    expect(isDirty(once)).toBe(false);
    expect(undoStep(once)).toEqual({ kind: "version", version: 8 });
    const back = versionUndone(once, 9);
    expect(undoStep(back)).toBeNull();
    expect(redoStep(back)).toEqual({ kind: "version", version: 9 });
    const again = versionRedone(back, 10);
    expect(undoStep(again)).toEqual({ kind: "version", version: 10 });
    expect(again.present.base).toBe(10);
  });
});

describe("a draft in the browser's keeping", () => {
  it("comes back as it was", () => {
    fc.assert(
      fc.property(walk, (actions) => {
        expect(parseDraft(JSON.stringify(walked(actions)))).toEqual(walked(actions));
      }),
    );
  });

  it("is nothing where the text is anything else", () => {
    for (const text of [null, "", "{", "null", "7", "[]", "{}", '{"present":{"base":1}}'])
      expect(parseDraft(text)).toBeNull();
  });
});

describe("discarding", () => {
  it("can itself be undone", () => {
    const draft = walked([(before) => edits.mergeRooms(before, ["r1", "r2"])]);
    expect(isDirty(discarded(draft))).toBe(false);
    expect(undone(discarded(draft)).present).toEqual(draft.present);
  });
});

describe("actions", () => {
  it("never change the list that they are given", () => {
    fc.assert(
      fc.property(walk, action, (actions, act) => {
        const { operations } = walked(actions).present;
        const before = JSON.stringify(operations);
        act(operations);
        expect(JSON.stringify(operations)).toBe(before);
      }),
    );
  });

  it("say one thing of one property only once", () => {
    fc.assert(
      fc.property(room, fc.string(), fc.string(), (r, first, second) => {
        const twice = edits.renameRoom(edits.renameRoom([], r, first), r, second);
        expect(twice).toHaveLength(1);
        expect(twice[0]).toMatchObject({ name: second });
      }),
    );
  });

  it("take back what was only drawn in the draft, without a trace", () => {
    const drawn = edits.moveDivider(
      edits.addDivider(
        [],
        [
          [0, 0],
          [1, 1],
        ],
      ),
      { index: 0 },
      [
        [0, 0],
        [2, 2],
      ],
    );
    expect(drawn).toEqual([
      {
        op: "add_divider",
        line: [
          [0, 0],
          [2, 2],
        ],
        kind: "open",
      },
    ]);
    expect(edits.setDividerKind(drawn, { index: 0 }, "door")[0]).toMatchObject({ kind: "door" });
    expect(edits.removeDivider(drawn, { index: 0 })).toEqual([]);
  });

  it("put a fix where it belongs", () => {
    const [fix] = edits.addDivider(
      [],
      [
        [0, 0],
        [0, 4],
      ],
    );
    if (!fix) throw new Error();
    const drawn = edits.addDivider(
      [],
      [
        [0, 0],
        [0, 1],
      ],
    );
    expect(edits.applyFix(drawn, "/operations/0", fix)).toEqual([fix]);
    expect(edits.applyFix(drawn, "/operations", fix)).toEqual([...drawn, fix]);
  });
});
