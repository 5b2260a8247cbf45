import { describe, expect, it } from "vitest";
import type { DividerFeature } from "../map/document";
import type { Conflict } from "../map/questions";
import { answersTo, type Situation } from "./answers";

type Action = Conflict["proposals"][number]["action"];

const NOT_TAKEN: Situation = { taken: false, ways: [], neighbour: null };
const TAKEN: Situation = { ...NOT_TAKEN, taken: true };
const OPEN = { response: "reject", at: "2026-11-29T08:41:00Z" } as const;

function room(id: string, passed = true): Conflict["rooms"][number] {
  return { id, name: id, precision: 1, recall: passed ? 1 : 0.4, passed, visited: true };
}

function asked(actions: readonly Action[], about: Partial<Conflict> = {}): Conflict {
  return {
    kind: "room_recall",
    cause: "unknown",
    state: "open",
    default: OPEN,
    dividers: [],
    rooms: [room("r1", false), room("r2")],
    proposals: actions.map((action, k) => ({
      id: `p${k + 1}`,
      action,
      recommended: k === 0,
      features: [],
      result: "",
    })),
    ...about,
  } as unknown as Conflict;
}

const said = (conflict: Conflict, situation: Situation) =>
  answersTo(conflict, situation).map(({ key, saying, about }) => `${key} ${saying} ${about.join("+")}`.trim());

describe("answers to a question", () => {
  it.each<[string, Conflict, Situation, string[]]>([
    [
      "about a mission that was not taken",
      asked(["keep_previous", "take_new"]),
      NOT_TAKEN,
      ["accept:p1 keep r1", "accept:p2 takeNew r1", "temporary temporary"],
    ],
    [
      "about a mission that waits with a repair",
      asked(["meta_dividers", "take_new", "keep_previous"]),
      NOT_TAKEN,
      ["accept:p1 repaired r1", "accept:p2 takeNew r1", "accept:p3 keep r1", "temporary temporary"],
    ],
    ["about a mission that leaves no choice", asked([]), NOT_TAKEN, ["reject keep r1", "temporary temporary"]],
    [
      "that the meta layer settled",
      asked(["meta_occupancy", "take_new"], { default: null, state: "resolved_automatically" }),
      TAKEN,
      ["accept:p1 keepRepair r1", "accept:p2 undoRepair r1"],
    ],
    [
      "that the meta layer settled, and that could not be otherwise",
      asked(["meta_dividers"], { default: null, state: "resolved_automatically" }),
      TAKEN,
      ["accept:p1 keepRepair r1", "reject undoRepair r1"],
    ],
    [
      "about a map that is in force",
      asked(["take_new"], { kind: "drift", cause: "drift", rooms: [room("r1")] }),
      TAKEN,
      ["accept:p1 right r1", "reject leave r1"],
    ],
    [
      "about an open way where the map keeps rooms apart",
      asked(["meta_dividers", "take_new"], {
        kind: "connectivity",
        cause: "new_passage",
        rooms: [room("r1"), room("r2")],
      }),
      TAKEN,
      ["accept:p1 apart r1+r2", "accept:p2 together r1+r2", "reject leave r1+r2", "temporary temporary"],
    ],
    [
      "about a divider that was shut",
      asked(["take_new"], { kind: "connectivity", cause: "door_closed", rooms: [] }),
      TAKEN,
      ["accept:p1 isDoor", "reject noDoor"],
    ],
    [
      "about a room that was found",
      asked(["take_new", "keep_previous"], {
        kind: "connectivity",
        cause: "new_passage",
        default: null,
        rooms: [room("r9")],
      }),
      { ...TAKEN, neighbour: "r1" },
      ["accept:p1 ownRoom r9", "accept:p2 partOf r1"],
    ],
    ["about a mission of another floor", asked([], { kind: "wrong_map", rooms: [] }), NOT_TAKEN, ["reject ignore"]],
  ])("%s", (_, conflict, situation, expected) => {
    expect(said(conflict, situation)).toEqual(expected);
  });

  it("begin with the recommended one", () => {
    const conflict = asked(["take_new", "keep_previous"]);
    const last = { ...conflict, proposals: conflict.proposals.map((p) => ({ ...p, recommended: p.id === "p2" })) };
    expect(answersTo(last, NOT_TAKEN)[0]).toMatchObject({ key: "accept:p2", saying: "keep", recommended: true });
  });

  it("include that an open way beside a lost room is a door, said before the room is kept", () => {
    const way = (id: string) =>
      ({ id, properties: { rooms: ["r1", "r2"], kind: "open" } }) as unknown as DividerFeature;
    const conflict = asked(["keep_previous", "take_new"], { kind: "room_lost" });
    const door = answersTo(conflict, { ...NOT_TAKEN, ways: [way("d1")] }).find(({ key }) => key === "door:d1");
    expect(door).toMatchObject({
      response: "accept",
      proposal: "p1",
      about: ["r1", "r2"],
      edit: { op: "set_divider_kind", id: "d1", kind: "door" },
    });
    const many = { ...NOT_TAKEN, ways: ["d1", "d2", "d3", "d4"].map(way) };
    expect(said(conflict, many).filter((one) => one.startsWith("door"))).toEqual([]);
  });
});
