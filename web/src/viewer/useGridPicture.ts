import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { cellsQuery } from "../api/queries";
import type { Scheme } from "../map/colours";
import type { MapDocument } from "../map/document";
import { RASTER_COLOURS, recolour } from "../map/raster";
import type { GridPicture } from "./GridLayer";

/** Some browsers refuse larger canvases (iOS: 16 million pixels). */
const LARGEST_CANVAS_PX = 16_000_000;

/** The grid of a version in the page's colours; null while it is loading or where it can't be had. */
export function useGridPicture(
  document: MapDocument,
  scheme: Scheme,
): { picture: GridPicture | null; failed: boolean } {
  const grid = useQuery(cellsQuery(document.cells));
  const { frame } = document;
  const picture = useMemo(
    () => (grid.data ? { image: painted(grid.data, scheme), frame } : null),
    [grid.data, frame, scheme],
  );
  return { picture, failed: grid.isError };
}

function painted(bitmap: ImageBitmap, scheme: Scheme): HTMLCanvasElement {
  const scale = Math.min(1, Math.sqrt(LARGEST_CANVAS_PX / (bitmap.width * bitmap.height)));
  const canvas = document.createElement("canvas");
  canvas.width = Math.floor(bitmap.width * scale);
  canvas.height = Math.floor(bitmap.height * scale);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) return canvas;
  context.imageSmoothingEnabled = false;
  context.drawImage(bitmap, 0, 0, canvas.width, canvas.height);
  const pixels = context.getImageData(0, 0, canvas.width, canvas.height);
  recolour(pixels.data, RASTER_COLOURS[scheme]);
  context.putImageData(pixels, 0, 0);
  return canvas;
}
