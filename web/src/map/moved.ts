/** A map document carried into another frame, so that two versions can be laid over each other. */

import type { MapDocument, MapFeature } from "./document";

/** (x, y, yaw): p -> R(yaw) p + (x, y). */
export type Pose = readonly [x: number, y: number, yaw: number];

export function movedDocument(document: MapDocument, [x, y, yaw]: Pose): MapDocument {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const move = ([px, py]: readonly [number, number]): [number, number] => [c * px - s * py + x, s * px + c * py + y];
  const [ox, oy, turn] = document.frame.origin;
  const [mx, my] = move([ox, oy]);
  return {
    ...document,
    frame: { ...document.frame, origin: [mx, my, turn + yaw] },
    features: document.features.map((feature) => {
      const { geometry } = feature;
      const coordinates =
        geometry.type === "Polygon"
          ? geometry.coordinates.map((ring) => ring.map(move))
          : geometry.coordinates.map(move);
      return { ...feature, geometry: { ...geometry, coordinates } } as MapFeature;
    }),
  };
}
