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

/** The grey levels of the service's picture of cells; any other is unexplored. */
const FREE = 254;
const OCCUPIED = 0;

/** Recolours RGBA pixels in place. Only the red channel is read: the pictures are grey. */
export function recolour(pixels: Uint8ClampedArray, { free, occupied }: RasterColours): void {
  const words = new Uint32Array(pixels.buffer, pixels.byteOffset, pixels.length / 4);
  const table = new Uint32Array(256);
  table[FREE] = opaque(free);
  table[OCCUPIED] = opaque(occupied);
  for (let i = 0; i < words.length; i++) words[i] = table[pixels[4 * i] ?? 0] ?? 0;
}

/** One RGBA pixel as a 32-bit word of the (little-endian) platform. */
function opaque([red, green, blue]: Rgb): number {
  return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}
