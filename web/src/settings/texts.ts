/** What the page about messages says, in the language that was chosen before it was loaded. */

import { settingsTexts as others, type SettingsTexts } from "../texts";
import { settingsEn } from "../texts/en.settings";

export const settingsTexts: SettingsTexts = others ?? settingsEn;
