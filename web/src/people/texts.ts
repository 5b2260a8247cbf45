/** What the pages about people say; the German is fetched only by those who read it. */

import { language, type PeopleTexts } from "../texts";
import { peopleEn } from "../texts/en.people";

export const peopleTexts: PeopleTexts = language === "de" ? (await import("../texts/de.people")).peopleDe : peopleEn;
