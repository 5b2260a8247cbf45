import { describe, expect, it } from "vitest";
import { type Mission, timeline, type Version } from "./history";

const at = (minute: number) => `2026-11-22T08:${String(minute).padStart(2, "0")}:00Z`;

function version(number: number, minute: number, cause: Version["cause"], mission: string): Version {
  return {
    robot: "RB",
    map: "ground",
    version: number,
    parent: number - 1,
    cause,
    mission,
    made_by: "operator",
    created_at: at(minute),
    rooms: 2,
    name: null,
    url: "",
  };
}

function mission(id: string, minute: number, outcome: Mission["outcome"]): Mission {
  return {
    id,
    robot: "RB",
    map: "ground",
    sequence: Number(id),
    epoch: 0,
    status: outcome === null ? "queued" : "done",
    outcome,
    succeeded_at: null,
    ablation: null,
    base_version: null,
    left_with: null,
    version: null,
    algorithm: null,
    rooms: [],
    conflicts: [],
    discovered_rooms: [],
    warnings: [],
    reason: "",
    candidates: [],
    decision: null,
    timings_ms: {},
    started_at: null,
    ended_at: null,
    received_at: at(minute),
    grid: "",
  };
}

const versions = [version(3, 31, "mission", "3"), version(2, 20, "edit", "0"), version(1, 1, "created", "0")];
const missions = [
  mission("4", 40, null),
  mission("3", 30, "updated"),
  mission("1", 10, "reverted"),
  mission("0", 0, "created"),
];
const names = (entries: ReturnType<typeof timeline>) =>
  entries.map((entry) => (entry.kind === "version" ? `v${entry.version.version}` : `m${entry.mission.id}`));

describe("the line of time", () => {
  it("has versions, and between them the missions that changed nothing or are not done", () => {
    const entries = timeline({ items: versions, more: false }, { items: missions, more: false });
    expect(names(entries)).toEqual(["m4", "v3", "v2", "m1", "v1"]);
  });

  it("tells which mission caused a version, but not of an edit on that mission's grid", () => {
    const entries = timeline({ items: versions, more: false }, { items: missions, more: false });
    const causes = entries.flatMap((entry) => (entry.kind === "version" ? [entry.mission?.id ?? null] : []));
    expect(causes).toEqual(["3", null, "0"]);
  });

  it("holds back what lies before the end of a list that has more", () => {
    const firstVersion = { items: versions.slice(0, 1), more: true };
    expect(names(timeline(firstVersion, { items: missions, more: false }))).toEqual(["m4", "v3"]);
    const firstMissions = { items: missions.slice(0, 2), more: true };
    expect(names(timeline({ items: versions, more: false }, firstMissions))).toEqual(["m4", "v3"]);
  });

  it("shows a version also while its mission is not read", () => {
    expect(names(timeline({ items: versions, more: false }, { items: [], more: false }))).toEqual(["v3", "v2", "v1"]);
  });
});
