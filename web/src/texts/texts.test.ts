import { describe, expect, it } from "vitest";
import { de, editorDe, reviewDe, settingsDe } from "./de";
import { fleetDe } from "./de.fleet";
import { peopleDe } from "./de.people";
import { privacyDe } from "./de.privacy";
import { en } from "./en";
import { editorEn } from "./en.editor";
import { fleetEn } from "./en.fleet";
import { peopleEn } from "./en.people";
import { privacyEn } from "./en.privacy";
import { reviewEn } from "./en.review";
import { settingsEn } from "./en.settings";

/** Every string and every sentence with blanks, by its path. */
function leaves(value: unknown, path = ""): Map<string, string> {
  const found = new Map<string, string>();
  if (typeof value === "string") found.set(path, value);
  else if (typeof value === "function") found.set(path, said(value as (...blanks: unknown[]) => string));
  else if (typeof value === "object" && value !== null)
    for (const [key, one] of Object.entries(value))
      for (const [p, text] of leaves(one, `${path}.${key}`)) found.set(p, text);
  return found;
}

/** A sentence, its blanks filled with what each takes. */
function said(sentence: (...blanks: unknown[]) => string): string {
  for (const blanks of [["X", [1, 2]], [2, 3], [[1, 2]], [["A", "B"]], ["X", 1, 2, 3]]) {
    try {
      return sentence(...blanks);
    } catch {
      // Those were not its blanks.
    }
  }
  throw new Error("a sentence whose blanks are not known");
}

/** The same word in both languages. */
const ALIKE = new Set([
  "stillroom",
  "Live",
  "Name",
  "Version 2",
  "Escape",
  "Garage",
  "Version X",
  "English",
  "Deutsch",
]);

describe.each([
  ["pages", en, de],
  ["the editor", editorEn, editorDe],
  ["the review page", reviewEn, reviewDe],
  ["messages", settingsEn, settingsDe],
  ["the fleet", fleetEn, fleetDe],
  ["people", peopleEn, peopleDe],
  ["privacy", privacyEn, privacyDe],
])("the texts of %s", (_, english, german) => {
  it("are the same ones in both languages, and none is left untranslated", () => {
    const [one, other] = [leaves(english), leaves(german)];
    expect([...other.keys()].sort()).toEqual([...one.keys()].sort());
    const same = [...one].filter(
      ([path, text]) => other.get(path) === text && /[a-z]{3}/.test(text) && !ALIKE.has(text),
    );
    expect(same).toEqual([]);
  });
});

it("what a button is called by its robot begins with what stands on it: who speaks to a browser says that", () => {
  for (const words of [privacyEn, privacyDe]) {
    expect(words.saveOf("Hall robot")).toMatch(new RegExp(`^${words.save}`));
    expect(words.logOf("Hall robot")).toMatch(new RegExp(`^${words.log}`));
    expect(words.eraseOf("Hall robot")).toMatch(new RegExp(`^${words.erase}`));
  }
});
