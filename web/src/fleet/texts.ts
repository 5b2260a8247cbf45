/** What the pages for fleet engineers say; the German is fetched only by those who read it. */

import { type FleetTexts, language } from "../texts";
import { fleetEn } from "../texts/en.fleet";

export const fleetTexts: FleetTexts = language === "de" ? (await import("../texts/de.fleet")).fleetDe : fleetEn;
