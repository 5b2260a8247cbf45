/** Figures as people read them, and what may be said of two of them. */

import { currentLocale } from "../numbers";
import type { Interval } from "./queries";
import { fleetTexts } from "./texts";

/** 0.1234 as "12.3 %". */
export function percent(share: number): string {
  return new Intl.NumberFormat(currentLocale(), {
    style: "percent",
    minimumFractionDigits: 1,
    maximumFractionDigits: 1,
  })
    .format(share)
    .replace(/(\d)%/, "$1\u202f%");
}

export function interval([low, high]: Interval): string {
  const number = new Intl.NumberFormat(currentLocale(), { minimumFractionDigits: 1, maximumFractionDigits: 1 });
  return fleetTexts.between(number.format(100 * low), number.format(100 * high));
}

/** A difference of shares in points: 0.0123 as "1.2". */
export function points(difference: number): string {
  const how = { minimumFractionDigits: 1, maximumFractionDigits: 1, signDisplay: "negative" } as const;
  return new Intl.NumberFormat(currentLocale(), how).format(100 * difference);
}

export const whole = (n: number): string => new Intl.NumberFormat(currentLocale()).format(n);

export const day = (iso: string): string => dated(iso, { dateStyle: "medium" });

export const shortDay = (iso: string): string => dated(iso, { day: "numeric", month: "short" });

function dated(iso: string, how: Intl.DateTimeFormatOptions): string {
  return new Intl.DateTimeFormat(currentLocale(), { ...how, timeZone: "UTC" }).format(new Date(iso));
}

/** A value that robots say of themselves. */
export const said = (value: string): string => value || fleetTexts.unknown;

/** Whether one of two intervals lies wholly above the other. That is stricter than a test at 5 %. */
export function compared(now: Interval, before: Interval): "higher" | "lower" | "same" {
  if (now[0] > before[1]) return "higher";
  return now[1] < before[0] ? "lower" : "same";
}

/** The end of an axis from 0 that all of these fit on: 5, 10, 20, 50 or 100 %, or a multiple of 10 %. */
export function axisEnd(shares: readonly number[]): number {
  const most = Math.max(0.01, ...shares);
  const steps = [0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1];
  return steps.find((one) => most <= one) ?? 1;
}
