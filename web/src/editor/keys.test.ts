import { describe, expect, it } from "vitest";
import type { MapDocument } from "../map/document";
import { HOME as home } from "../map/fixtures/home";
import type { Operations } from "../map/operations";
import { project } from "../map/project";
import { viewMap } from "../map/view";
import { idOf, keysOf, type Shown } from "./keys";
import { chordAcross } from "./targets";

const none = { document: { ...home, features: [] }, made: [], keys: new Map<string, string>() };
const start = { document: home, made: [], keys: keysOf({ document: home, made: [] }, none) };
const [room] = viewMap(home).rooms;
if (!room) throw new Error("a home without rooms");
const line = chordAcross(room.rings, "upright", 0.5);
if (!line) throw new Error("a room that can't be divided");
const divide: Operations = [{ op: "add_divider", line: [[...line[0]], [...line[1]]], kind: "open" }];

/** As the service answers: with other names for what is new. */
function named({ document, made }: Shown): Shown {
  const known = new Set(home.features.map(({ id }) => id));
  const name = (id: string) => (known.has(id) ? id : `named ${id}`);
  const features = document.features.map((one) => ({ ...one, id: name(one.id) }));
  return {
    document: { ...document, features } as MapDocument,
    made: made.map(({ pointer, feature }) => ({ pointer, feature: name(feature) })),
  };
}

describe("keys of features", () => {
  it("are the ids of what was there from the start", () => {
    expect([...start.keys].every(([id, key]) => id === key)).toBe(true);
  });

  it("stay when the service names what the draft makes, and when the draft is drawn before it answers again", () => {
    const drawn = project(home, divide);
    const before = { ...drawn, keys: keysOf(drawn, start) };
    const made = [...before.keys].filter(([id]) => !start.keys.has(id));
    expect(made).toHaveLength(2);
    const answer = named(drawn);
    const after = { ...answer, keys: keysOf(answer, before) };
    for (const [id, key] of made) expect(idOf(key, after.keys)).toBe(`named ${id}`);
    expect(keysOf(drawn, after)).toEqual(before.keys);
  });

  it("are never those of another thing", () => {
    const drawn = project(home, divide);
    const answer = named(drawn);
    const before = { ...drawn, keys: keysOf(drawn, start) };
    const saved = { document: answer.document, made: [], keys: keysOf(answer, before) };
    const wall: Operations = [{ op: "add_restriction", kind: "virtual_wall", shape: [[...line[0]], [...line[1]]] }];
    const next = project(saved.document, wall);
    const keys = keysOf(next, saved);
    expect(new Set(keys.values()).size).toBe(next.document.features.length);
  });

  it("go with what is taken back", () => {
    const drawn = project(home, divide);
    const before = { ...drawn, keys: keysOf(drawn, start) };
    const gone = [...before.keys.values()].filter((key) => !start.keys.has(key));
    const after = keysOf({ document: home, made: [] }, before);
    expect(after).toEqual(start.keys);
    for (const key of gone) expect(idOf(key, after)).toBeNull();
  });
});
