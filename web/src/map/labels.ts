/** What of a room's label is shown at a zoom. */

import type { LabelSpot } from "./geometry";

export interface Label {
  readonly name: string;
  readonly area: string;
  readonly spot: LabelSpot;
}

/** Width of a text in CSS pixels as it will be drawn. */
export type Measure = (text: string, part: LabelPart) => number;
export type LabelPart = "name" | "area";
export type ShownParts = "name and area" | "name" | "nothing";

export const LINE_HEIGHT_PX = { name: 18, area: 16 } as const;

/** A name may stick out of its room by this much before it is left out: a name over a wall says more than none. */
const OVERHANG = 1.35;
const SMALLEST_ROOM_PX = 12;

/** `resolution` in metres a CSS pixel. Names that would still run into each other are thinned out by the map's own declutter. */
export function shownParts(label: Label, resolution: number, measure: Measure): ShownParts {
  const width = label.spot.width / resolution;
  const height = label.spot.height / resolution;
  const nameWidth = measure(label.name, "name");
  if (nameWidth > width * OVERHANG || height < SMALLEST_ROOM_PX) return "nothing";
  const both = LINE_HEIGHT_PX.name + LINE_HEIGHT_PX.area;
  const widest = Math.max(nameWidth, measure(label.area, "area"));
  return both <= height && widest <= width ? "name and area" : "name";
}
