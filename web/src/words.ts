/** Facts of the API in plain words. */

import { type Conflict, isDiscovery, isParked } from "./map/questions";
import { currentLocale } from "./numbers";
import { conflictTexts, texts } from "./texts";

const UNITS: readonly (readonly [Intl.RelativeTimeFormatUnit, number])[] = [
  ["year", 31_536_000],
  ["month", 2_592_000],
  ["week", 604_800],
  ["day", 86_400],
  ["hour", 3_600],
  ["minute", 60],
];

/** "5 minutes ago"; "just now" within a minute, also for clocks that run a little ahead. */
export function ago(moment: Date, now: Date): string {
  const seconds = (moment.getTime() - now.getTime()) / 1000;
  const unit = UNITS.find(([, length]) => Math.abs(seconds) >= length);
  if (!unit) return texts.justNow;
  const relative = new Intl.RelativeTimeFormat(currentLocale(), { numeric: "auto" });
  return relative.format(Math.trunc(seconds / unit[1]), unit[0]);
}

export function fullTime(moment: Date): string {
  return new Intl.DateTimeFormat(currentLocale(), { dateStyle: "medium", timeStyle: "short" }).format(moment);
}

/** Who made a version: `robot:RB-0042`, `user:ann@example.org`, `operator`, … */
export function madeBy(who: string): string {
  const [kind, name] = who.split(/:(.*)/s);
  switch (kind) {
    case "robot":
      return texts.history.by.robot;
    case "operator":
      return texts.history.by.operator;
    case "service":
      return texts.history.by.service;
    default:
      return texts.history.by.person(name || who);
  }
}

export interface Score {
  readonly precision: number;
  readonly recall: number;
  readonly passed: boolean;
  readonly visited?: boolean;
}

/** Differences up to this many percent are the walls' own wobble. */
const WOBBLE_PERCENT = 3;

/** Precision and recall as a person would say them: recall is what is left of the room, precision what of its new shape was in it before. */
export function describeScore({ precision, recall, passed, visited = true }: Score): string {
  if (!visited) return texts.score.notVisited;
  if (recall === 0) return texts.score.gone;
  const lost = Math.round((1 - recall) * 100);
  const gained = Math.round((1 - precision) * 100);
  const parts = [
    ...(lost > WOBBLE_PERCENT ? [texts.score.lost(lost)] : []),
    ...(gained > WOBBLE_PERCENT ? [texts.score.gained(gained)] : []),
    ...(passed ? [] : [texts.score.failed]),
  ];
  return parts.join(", ") || texts.score.asBefore;
}

export function isUnchanged(score: Score): boolean {
  return describeScore(score) === texts.score.asBefore;
}

interface MissionState {
  readonly status: string;
  readonly outcome: string | null;
  readonly version: number | null;
}

/** What a mission came to, or how far it is. */
export function describeMission({ status, outcome, version }: MissionState): string {
  if (outcome === "reverted" && version === null) return texts.notCreated;
  return outcome === null ? (texts.status[status] ?? status) : (texts.outcome[outcome] ?? outcome);
}

/** What a question is about, in a sentence: the service's own in English. */
export function describeConflict(conflict: Conflict): string {
  const { kind, cause, state, rooms, summary } = conflict;
  if (isParked(conflict)) return texts.questions.parked;
  const settled = state === "resolved_automatically";
  const isHeld = kind === "connectivity" && conflict.proposals.some(({ action }) => action === "keep_previous");
  const isRepaired = conflict.proposals.some(({ action }) => action.startsWith("meta_"));
  const keys = [
    ...(isDiscovery(conflict) ? ["connectivity discovery"] : isHeld ? [`held ${cause}`] : []),
    `${kind} ${cause}`,
    ...(!settled && kind.startsWith("room_") && isRepaired ? ["held room"] : []),
    ...(settled && kind.startsWith("room_") ? ["settled"] : []),
    kind,
  ];
  const say = keys.map((key) => conflictTexts[key]).find((one) => one !== undefined);
  const failed = rooms.filter(({ passed }) => !passed);
  const names = listed((failed.length > 0 && !settled ? failed : rooms).map(({ name }) => name));
  return say?.(names, Math.round((1 - Math.min(1, ...rooms.map(({ recall }) => recall))) * 100)) ?? summary;
}

/** "Kitchen", "Kitchen and Hall", "Kitchen, Hall and Bath". */
export function listed(names: readonly string[]): string {
  return new Intl.ListFormat(currentLocale(), { style: "long", type: "conjunction" }).format(names);
}

interface Change {
  readonly code: string;
  readonly name: string;
  readonly value: number | null;
  readonly text: string;
}

/** The service says it in English; other languages have their own words for each kind of change. */
export function describeChange({ code, name, value, text }: Change): string {
  return texts.change[code]?.(name, value ?? 0) ?? text;
}
