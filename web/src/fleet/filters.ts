/** Which missions the figures are about, as it stands in the address of a page. */

import type { Schemas } from "../api/client";

export type Size = Schemas["FiltersDocument"]["size"][number];
export const SPANS = [1, 7, 30, 90, 365] as const;
export type Span = (typeof SPANS)[number];
export const DEFAULT_SPAN: Span = 30;
const SIZES: readonly Size[] = ["", "1-3", "4-6", "7-9", "10+"];
/** Beyond this many days they are drawn by weeks. */
const MOST_DAYS_DRAWN = 92;
const DAY_MS = 86_400_000;

export const VALUES = ["firmware", "model", "algorithm", "size"] as const;
export type Value = (typeof VALUES)[number];

export interface Filters {
  /** Days up to today. Null: `from` and `to` count. */
  readonly days: Span | null;
  readonly from: string | null;
  readonly to: string | null;
  readonly firmware: readonly string[];
  readonly model: readonly string[];
  readonly algorithm: readonly string[];
  readonly size: readonly Size[];
}

/** What cannot be understood is as if it were not there. */
export function readFilters(search: URLSearchParams): Filters {
  const days = SPANS.find((one) => String(one) === search.get("days")) ?? null;
  const [from, to] = days === null ? [dayIn(search, "from"), dayIn(search, "to")] : [null, null];
  return {
    days: days ?? (from === null && to === null ? DEFAULT_SPAN : null),
    from,
    to,
    firmware: search.getAll("firmware"),
    model: search.getAll("model"),
    algorithm: search.getAll("algorithm"),
    size: search.getAll("size").filter((one): one is Size => (SIZES as readonly string[]).includes(one)),
  };
}

/** The address's part after the question mark; what is the default is left out. */
export function searchOf(filters: Filters): string {
  const search = new URLSearchParams();
  if (filters.days !== null && filters.days !== DEFAULT_SPAN) search.set("days", String(filters.days));
  if (filters.from !== null) search.set("from", filters.from);
  if (filters.to !== null) search.set("to", filters.to);
  for (const name of VALUES) for (const value of filters[name]) search.append(name, value);
  return search.toString();
}

/** The first and the last day, both counted, in UTC. An end that is not said is today, a beginning a month before the end. */
export function spanOf({ days, from, to }: Filters, now: Date): { readonly from: string; readonly to: string } {
  const today = dayOf(now);
  if (days !== null) return { from: shifted(today, 1 - days), to: today };
  const end = to ?? today;
  const begin = from ?? shifted(end, 1 - DEFAULT_SPAN);
  return begin <= end ? { from: begin, to: end } : { from: end, to: begin };
}

export function queryOf(filters: Filters, now: Date) {
  const { firmware, model, algorithm, size } = filters;
  return {
    ...spanOf(filters, now),
    firmware: [...firmware],
    model: [...model],
    algorithm: [...algorithm],
    size: [...size],
  };
}

export function step(filters: Filters, now: Date): "day" | "week" {
  const { from, to } = spanOf(filters, now);
  return daysBetween(from, to) < MOST_DAYS_DRAWN ? "day" : "week";
}

/** The same missions of other days. */
export const during = (filters: Filters, from: string, to: string): Filters => ({ ...filters, days: null, from, to });

export const dayOf = (moment: Date): string => moment.toISOString().slice(0, 10);

export const shifted = (day: string, days: number): string => dayOf(new Date(Date.parse(day) + days * DAY_MS));

export const daysBetween = (from: string, to: string): number =>
  Math.round((Date.parse(to) - Date.parse(from)) / DAY_MS);

/** Every day, or every Monday, from the one that `from` lies in. */
export function every(unit: "day" | "week", from: string, to: string): string[] {
  const length = unit === "week" ? 7 : 1;
  const first = unit === "week" ? mondayOf(from) : from;
  return Array.from({ length: Math.floor(daysBetween(first, to) / length) + 1 }, (_, i) => shifted(first, i * length));
}

function mondayOf(day: string): string {
  return shifted(day, -((new Date(day).getUTCDay() + 6) % 7));
}

function dayIn(search: URLSearchParams, name: string): string | null {
  const said = search.get(name);
  if (said === null || !/^\d{4}-\d{2}-\d{2}$/.test(said)) return null;
  const moment = new Date(said);
  return Number.isNaN(moment.getTime()) || dayOf(moment) !== said ? null : said;
}
