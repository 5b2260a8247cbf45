import { afterEach, describe, expect, it, vi } from "vitest";
import { Problem } from "../api/client";
import type { MapDocument, MapFeature } from "../map/document";
import type { Entry } from "../map/history";
import * as calls from "./calls";
import { differenceOf, hasDrawn, isUntouched, tryOut } from "./sensitivity";

const PLACE = { robot: "RB-1", map: "ground" };
const REMOVE = { op: "remove_divider", id: "d1" } as const;
const { signal } = new AbortController();

function room(id: string, name: string): MapFeature {
  const properties = { semantic: "room", name, area: 1, made_by: "algorithm", segment_id: 1 };
  return { type: "Feature", id, geometry: { type: "Polygon", coordinates: [] }, properties } as unknown as MapFeature;
}

const homeOf = (...names: string[]) =>
  ({ version: 1, features: names.map((name, n) => room(`r${n}`, name)) }) as unknown as MapDocument;

const version = (cause: string) => ({ kind: "version", at: "", version: { cause }, mission: null }) as unknown as Entry;

/** The service's answers, one after the other. */
function suggesting(...versions: number[]) {
  const asked = vi.spyOn(calls, "askSuggested");
  for (const number of versions) {
    const data = { version: number, operations: [REMOVE] };
    asked.mockResolvedValueOnce({ data, response: new Response() } as never);
  }
  return asked;
}

afterEach(() => vi.restoreAllMocks());

describe("what differs", () => {
  it("is counted, and names that were given are missed where rooms merge", () => {
    const before = homeOf("Kitchen", "Room 2", "Bath", "Room 4");
    expect(differenceOf(before, homeOf("Kitchen", "Room 4"))).toEqual({ before: 4, after: 2, lost: ["Bath"] });
  });

  it("loses no name where rooms are only divided", () => {
    expect(differenceOf(homeOf("Kitchen"), homeOf("Kitchen", "Kitchen 2"))).toEqual({ before: 1, after: 2, lost: [] });
  });
});

describe("a map", () => {
  it("is untouched while missions alone made its versions", () => {
    expect(isUntouched([version("mission"), version("created")])).toBe(true);
    for (const cause of ["edit", "decision", "restore", "import"])
      expect(isUntouched([version(cause), version("created")])).toBe(false);
    expect(isUntouched([])).toBe(false);
  });

  it("has drawn dividers where people made some", () => {
    const divider = (made_by: string) =>
      ({ features: [{ properties: { semantic: "divider", made_by } }] }) as unknown as MapDocument;
    expect(hasDrawn(divider("user"))).toBe(true);
    expect(hasDrawn(divider("algorithm"))).toBe(false);
  });
});

describe("trying out", () => {
  it("asks what the suggested operations come to on the version they are for", async () => {
    suggesting(7);
    const value = homeOf("Kitchen");
    const preview = vi.spyOn(calls, "previewEdit").mockResolvedValue({ kind: "done", value } as never);
    expect(await tryOut(PLACE, -2, signal)).toEqual({ version: 7, operations: [REMOVE], document: value });
    expect(preview).toHaveBeenCalledWith(PLACE, 7, [REMOVE]);
  });

  it("asks for no preview where nothing would change", async () => {
    const nothing = { data: { version: 7, operations: [] }, response: new Response() };
    vi.spyOn(calls, "askSuggested").mockResolvedValue(nothing as never);
    const preview = vi.spyOn(calls, "previewEdit");
    expect((await tryOut(PLACE, 0, signal)).document).toBeNull();
    expect(preview).not.toHaveBeenCalled();
  });

  it("begins anew where another version comes into force in between", async () => {
    const asked = suggesting(7, 8);
    vi.spyOn(calls, "previewEdit")
      .mockResolvedValueOnce({ kind: "stale", problem: {} } as never)
      .mockResolvedValueOnce({ kind: "done", value: homeOf("Kitchen") } as never);
    expect((await tryOut(PLACE, 1, signal)).version).toBe(8);
    expect(asked).toHaveBeenCalledTimes(2);
  });

  it.each([
    ["is not reachable", { kind: "unreachable" }, 0],
    ["refuses it", { kind: "refused", problem: { errors: [], detail: "No." } }, 422],
    ["is always a version ahead", { kind: "stale", problem: {} }, 412],
  ])("fails where the service %s", async (_, answer, status) => {
    suggesting(7, 8, 9);
    vi.spyOn(calls, "previewEdit").mockResolvedValue(answer as never);
    const failure = await tryOut(PLACE, 1, signal).catch((error: unknown) => error);
    expect(failure).toBeInstanceOf(Problem);
    expect((failure as Problem).status).toBe(status);
  });
});
