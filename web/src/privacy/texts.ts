/** What is said about what is kept; the German is fetched only by those who read it. */

import { language, type PrivacyTexts } from "../texts";
import { privacyEn } from "../texts/en.privacy";

export const privacyTexts: PrivacyTexts =
  language === "de" ? (await import("../texts/de.privacy")).privacyDe : privacyEn;
