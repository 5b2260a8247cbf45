import { useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef, useState } from "react";
import type { MapDocument } from "../map/document";
import type { Layer } from "../map/styles";
import type { MapView } from "../map/view";
import { HomeMap } from "./HomeMap";
import { LAYERS } from "./LayersMenu";
import classes from "./SwipeLayer.module.css";
import { useGridPicture } from "./useGridPicture";

interface SwipeLayerProps {
  /** The map that it lies over, which is the one that people move. */
  readonly over: HomeMap;
  readonly hidden: ReadonlySet<Layer>;
  readonly document: MapDocument;
  readonly view: MapView;
  /** Percent of the width that it covers, from the left. */
  readonly share: number;
}

/** A second map that covers the left part of another one, in the same place and size. */
export function SwipeLayer({ over, hidden, document, view, share }: SwipeLayerProps) {
  const target = useRef<HTMLDivElement>(null);
  const [map, setMap] = useState<HomeMap | null>(null);
  const scheme = useComputedColorScheme("light", { getInitialValueInEffect: false });
  const { picture } = useGridPicture(document, scheme);

  useEffect(() => {
    if (!target.current) return;
    const made = new HomeMap(target.current, () => undefined);
    made.picks = false;
    setMap(made);
    return () => {
      made.dispose();
      setMap(null);
    };
  }, []);
  useEffect(() => {
    if (!map) return;
    map.show(view, scheme);
    return map.follow(over);
  }, [map, over, view, scheme]);
  useEffect(() => map?.showGrid(picture), [map, picture]);
  useEffect(() => {
    for (const layer of LAYERS) map?.setVisible(layer, !hidden.has(layer));
  }, [map, hidden]);

  return (
    <>
      <div
        ref={target}
        className={classes.layer}
        aria-hidden="true"
        data-version={document.version}
        style={{ clipPath: `inset(0 ${100 - share}% 0 0)` }}
      />
      {share > 0 && share < 100 && <div className={classes.edge} style={{ left: `${share}%` }} />}
    </>
  );
}
