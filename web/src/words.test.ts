import { describe, expect, it } from "vitest";
import { ago, describeMission, describeScore, isUnchanged, madeBy } from "./words";

describe("how long ago", () => {
  const now = new Date("2026-11-22T12:00:00Z");
  it.each([
    ["2026-11-22T11:59:31Z", "just now"],
    ["2026-11-22T12:00:20Z", "just now"],
    ["2026-11-22T11:58:59Z", "1 minute ago"],
    ["2026-11-22T09:01:00Z", "2 hours ago"],
    ["2026-11-21T10:00:00Z", "yesterday"],
    ["2026-11-10T10:00:00Z", "last week"],
    ["2024-11-10T10:00:00Z", "2 years ago"],
  ])("%s is %s", (moment, words) => {
    expect(ago(new Date(moment), now)).toBe(words);
  });
});

describe("who made a version", () => {
  it.each([
    ["robot:RB-0042", "by the robot"],
    ["operator", "by an operator"],
    ["user:ann:x@example.org", "by ann:x@example.org"],
    ["somebody", "by somebody"],
  ])("%s: %s", (who, words) => {
    expect(madeBy(who)).toBe(words);
  });
});

describe("how a room came through", () => {
  const score = { precision: 1, recall: 1, passed: true };

  it("says nothing of the walls' wobble", () => {
    expect(describeScore({ ...score, precision: 0.975, recall: 0.97 })).toBe("as before");
    expect(isUnchanged({ ...score, precision: 0.975, recall: 0.97 })).toBe(true);
  });

  it("says what share is gone and what share is new", () => {
    expect(describeScore({ ...score, recall: 0.41, passed: false })).toBe(
      "59 % of it is gone, too much to be taken by itself",
    );
    expect(describeScore({ ...score, precision: 0.8, recall: 0.9 })).toBe(
      "10 % of it is gone, 20 % of its shape is new",
    );
    expect(describeScore({ precision: 0, recall: 0, passed: false })).toBe("not found any more");
  });

  it("does not judge a room that was not visited", () => {
    expect(describeScore({ precision: 0, recall: 0, passed: false, visited: false })).toBe(
      "not visited, left as it was",
    );
  });
});

describe("what a mission came to", () => {
  it.each([
    [{ status: "queued", outcome: null, version: null }, "Waiting to be worked on"],
    [{ status: "done", outcome: "resolved", version: 3 }, "Map updated, after a repair"],
    [{ status: "done", outcome: "reverted", version: 3 }, "Kept the previous map"],
    [{ status: "done", outcome: "reverted", version: null }, "No map could be made"],
    [{ status: "done", outcome: "of a later server", version: null }, "of a later server"],
  ])("%o: %s", (mission, words) => {
    expect(describeMission(mission)).toBe(words);
  });
});
