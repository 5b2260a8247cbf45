import { afterEach, expect, test, vi } from "vitest";
import { forgetDrafts } from "./forgetting";

afterEach(() => vi.unstubAllGlobals());

test("drafts of a robot that was given up, and of who signs out, are forgotten, and nothing else", () => {
  const kept: Record<string, unknown> = {};
  for (const key of ["stillroom-draft:RB-1/ground:1", "stillroom-draft:RB-10/ground:1", "stillroom-language"])
    kept[key] = "something";
  Object.defineProperty(kept, "removeItem", { value: (key: string) => delete kept[key] });
  vi.stubGlobal("localStorage", kept);
  forgetDrafts("RB-1");
  expect(Object.keys(kept)).toEqual(["stillroom-draft:RB-10/ground:1", "stillroom-language"]);
  forgetDrafts();
  expect(Object.keys(kept)).toEqual(["stillroom-language"]);
});
