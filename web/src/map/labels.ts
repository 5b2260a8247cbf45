/** What of a room's label is shown at a zoom. */

import type { LabelSpot } from "./geometry";

export interface Label {
  readonly name: string;
  readonly area: string;
  readonly spot: LabelSpot;
}

/** Width of a text in CSS pixels as it will be drawn at scale 1. */
export type Measure = (text: string, part: LabelPart) => number;
export type LabelPart = "name" | "area";

/** What is left of a label. Its name is always shown; `scale` is the size of its letters. */
export interface ShownLabel {
  readonly area: boolean;
  readonly scale: number;
}

const LINE_HEIGHT_PX = { name: 18, area: 16 } as const;
const SMALLER = 0.8;

/** A name may stick out of its room by this much before it is left out: a name over a wall says more than none. */
const OVERHANG = 1.4;

/**
 * Name and area where both fit, else the name, at last in smaller letters; null where the room is too small even for that.
 * `resolution` in metres a CSS pixel. Names that would still run into each other are thinned out by the map's own declutter.
 */
export function shownLabel(label: Label, resolution: number, measure: Measure): ShownLabel | null {
  const width = label.spot.width / resolution;
  const height = label.spot.height / resolution;
  const nameWidth = measure(label.name, "name");
  const bothWidth = Math.max(nameWidth, measure(label.area, "area"));
  if (bothWidth <= width && LINE_HEIGHT_PX.name + LINE_HEIGHT_PX.area <= height) return { area: true, scale: 1 };
  const fits = (scale: number, overhang: number) =>
    nameWidth * scale <= width * overhang && LINE_HEIGHT_PX.name * scale <= height * overhang;
  if (fits(1, 1)) return { area: false, scale: 1 };
  return fits(SMALLER, OVERHANG) ? { area: false, scale: SMALLER } : null;
}
