/** A floor plan as paths of a drawing: metres, x to the right, y up. */

import type { Position } from "../map/document";
import { boundsOf, frameBounds } from "../map/geometry";
import type { Figure } from "./queries";

export type Shape = Figure["candidate"][number];
type Geometry = Shape["geometry"];

export interface Extent {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

const MARGIN_M = 0.5;

export function pathOf(geometry: Geometry): string {
  switch (geometry.type) {
    case "Polygon":
      return geometry.coordinates.map((ring) => `${line(ring)}Z`).join("");
    case "LineString":
      return line(geometry.coordinates);
    default:
      return "";
  }
}

export const ofKind = (shapes: readonly Shape[], semantic: Shape["properties"]["semantic"]): readonly Shape[] =>
  shapes.filter(({ properties }) => properties.semantic === semantic);

/** What is worth to be seen: all that was judged or tracked; the whole grid, where nothing was. */
export function extentOf({ frame, candidate, tracked }: Figure): Extent {
  const points = [...candidate, ...tracked].flatMap(({ geometry }) => positions(geometry));
  const [left, bottom, right, top] = points.length > 0 ? boundsOf(points) : frameBounds(frame);
  return {
    x: left - MARGIN_M,
    y: bottom - MARGIN_M,
    width: right - left + 2 * MARGIN_M,
    height: top - bottom + 2 * MARGIN_M,
  };
}

function positions(geometry: Geometry): readonly Position[] {
  switch (geometry.type) {
    case "Polygon":
      return geometry.coordinates.flat();
    case "LineString":
      return geometry.coordinates;
    default:
      return [];
  }
}

function line(points: readonly Position[]): string {
  return points.map(([x, y], i) => `${i === 0 ? "M" : "L"}${round(x)} ${round(y)}`).join("");
}

const round = (metres: number): number => Math.round(metres * 1000) / 1000;
