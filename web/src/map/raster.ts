/** The occupancy picture in a page's own colours. */

import type { Scheme } from "./colours";

export type Rgb = readonly [number, number, number];

export interface RasterColours {
  readonly free: Rgb;
  readonly occupied: Rgb;
}

/** Unexplored cells are see-through, so they take the colour of the page. */
export const RASTER_COLOURS: Readonly<Record<Scheme, RasterColours>> = {
  light: { free: [255, 253, 248], occupied: [92, 79, 68] },
  dark: { free: [48, 43, 38], occupied: [203, 188, 168] },
};

/** How grey values are to be read: map_server's fields, as the mission gave them. */
export interface Reading {
  readonly mode: "trinary" | "scale" | "raw";
  readonly negate: boolean;
  readonly occupied_thresh: number;
  readonly free_thresh: number;
}

export const DEFAULT_READING: Reading = { mode: "trinary", negate: false, occupied_thresh: 0.65, free_thresh: 0.196 };

const UNEXPLORED_GREY = 205;
const RAW_UNEXPLORED = 255;

/** For each grey value the opacity of "occupied" over "free" (0 to 1), or null for unexplored. */
export function readGreys(reading: Reading): readonly (number | null)[] {
  return Array.from({ length: 256 }, (_, grey) => readGrey(grey, reading));
}

function readGrey(grey: number, { mode, negate, occupied_thresh, free_thresh }: Reading): number | null {
  if (mode === "raw") return grey === RAW_UNEXPLORED || grey > 100 ? null : grey / 100;
  if (mode === "trinary" && grey === UNEXPLORED_GREY) return null;
  const occupancy = (negate ? grey : 255 - grey) / 255;
  if (occupancy > occupied_thresh) return 1;
  if (occupancy < free_thresh) return 0;
  return mode === "scale" ? (occupancy - free_thresh) / (occupied_thresh - free_thresh) : null;
}

/** Recolours RGBA pixels in place. Only the red channel is read: the pictures are grey. */
export function recolour(pixels: Uint8ClampedArray, colours: RasterColours, reading: Reading = DEFAULT_READING): void {
  const words = new Uint32Array(pixels.buffer, pixels.byteOffset, pixels.length / 4);
  const table = new Uint32Array(readGreys(reading).map((occupied) => (occupied === null ? 0 : mix(colours, occupied))));
  for (let i = 0, byte = 0; i < words.length; i++, byte += 4) {
    words[i] = pixels[byte + 3] === 0 ? 0 : (table[pixels[byte] ?? 0] ?? 0);
  }
}

/** One RGBA pixel as the platform's (little-endian) 32-bit word. */
function mix({ free, occupied }: RasterColours, share: number): number {
  const channel = (i: 0 | 1 | 2) => Math.round(free[i] + (occupied[i] - free[i]) * share);
  return ((255 << 24) | (channel(2) << 16) | (channel(1) << 8) | channel(0)) >>> 0;
}
