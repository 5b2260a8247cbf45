/** What people read, in their language: one catalogue a language, each complete. */

import { setLocale } from "./numbers";
import { en } from "./texts/en";
import type { editorEn } from "./texts/en.editor";
import type { fleetEn } from "./texts/en.fleet";
import type { peopleEn } from "./texts/en.people";
import type { privacyEn } from "./texts/en.privacy";
import type { reviewEn } from "./texts/en.review";
import type { settingsEn } from "./texts/en.settings";

export { area, count } from "./numbers";

export type Texts = typeof en;
export type ConflictTexts = Readonly<Record<string, (rooms: string, percent: number) => string>>;
export type EditorTexts = typeof editorEn;
export type FleetTexts = typeof fleetEn;
export type PeopleTexts = typeof peopleEn;
export type PrivacyTexts = typeof privacyEn;
export type ReviewTexts = typeof reviewEn;
export type SettingsTexts = typeof settingsEn;
export type Language = "en" | "de";

const KEPT = "stillroom-language";

export let texts: Texts = en;
/** Those of pages that bring their own, where they are not the English ones, which come with each of them. */
export let editorTexts: EditorTexts | null = null;
export let reviewTexts: ReviewTexts | null = null;
export let settingsTexts: SettingsTexts | null = null;
/** What questions are about, where the service's own English is not wanted. */
export let conflictTexts: ConflictTexts = {};
export let language: Language = "en";

/** To be called before anything is drawn. */
export async function chooseLanguage(): Promise<void> {
  const wanted = [localStorage.getItem(KEPT), ...navigator.languages].find((one) => one && /^(en|de)\b/.test(one));
  if (wanted?.startsWith("de")) {
    const german = await import("./texts/de");
    texts = german.de;
    editorTexts = german.editorDe;
    reviewTexts = german.reviewDe;
    settingsTexts = german.settingsDe;
    conflictTexts = german.conflictDe;
    language = "de";
  }
  setLocale(language);
  document.documentElement.lang = language;
}

/** The page is loaded anew: nothing of it was written in two languages. */
export function switchLanguage(): void {
  localStorage.setItem(KEPT, language === "en" ? "de" : "en");
  location.reload();
}
