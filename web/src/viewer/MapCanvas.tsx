import { ActionIcon, useComputedColorScheme } from "@mantine/core";
import { type ReactNode, useEffect, useId, useMemo, useRef, useState } from "react";
import { Icon, type IconName } from "../icons";
import type { MapDocument } from "../map/document";
import type { Layer } from "../map/styles";
import type { MapView } from "../map/view";
import { texts } from "../texts";
import { HomeMap } from "./HomeMap";
import { LAYERS, LayersMenu } from "./LayersMenu";
import classes from "./MapCanvas.module.css";
import { useGridPicture } from "./useGridPicture";

/** What is selected; `centre` asks the map to bring it into the middle. */
export interface Selection {
  readonly room: string | null;
  readonly centre: boolean;
}

/** Between the map and what lies over it, and from there to the edge. */
const BESIDE_PX = 16;

export const NOTHING: Selection = { room: null, centre: false };

interface MapCanvasProps {
  readonly title: string;
  readonly document: MapDocument;
  readonly view: MapView;
  readonly selection: Selection;
  readonly onSelect: (room: string | null) => void;
  /** Told of the map itself as soon as it is there, and of null when it goes. */
  readonly onMap?: (map: HomeMap | null) => void;
  /** Another map, to be laid over this one. */
  readonly over?: (map: HomeMap, hidden: ReadonlySet<Layer>) => ReactNode;
  /** Lies over the lower edge of the map. */
  readonly children: ReactNode;
}

export function MapCanvas({ title, document, view, selection, onSelect, onMap, over, children }: MapCanvasProps) {
  const target = useRef<HTMLDivElement>(null);
  const below = useRef<HTMLDivElement>(null);
  const [map, setMap] = useState<HomeMap | null>(null);
  const [hidden, setHidden] = useState<ReadonlySet<Layer>>(new Set());
  const scheme = useComputedColorScheme("light", { getInitialValueInEffect: false });
  const { picture, failed } = useGridPicture(document, scheme);
  const keysId = useId();
  const select = useRef(onSelect);
  select.current = onSelect;
  const told = useRef(onMap);
  told.current = onMap;

  useEffect(() => {
    if (!target.current) return;
    const made = new HomeMap(target.current, (room) => select.current(room));
    setMap(made);
    told.current?.(made);
    return () => {
      told.current?.(null);
      made.dispose();
      setMap(null);
    };
  }, []);
  useEffect(() => map?.show(view, scheme), [map, view, scheme]);
  useEffect(() => map?.showGrid(picture), [map, picture]);
  useEffect(() => map?.select(selection.room, selection.centre), [map, selection]);
  useEffect(() => {
    for (const layer of LAYERS) map?.setVisible(layer, !hidden.has(layer));
  }, [map, hidden]);

  useEffect(() => {
    const { current } = below;
    if (!map || !current) return;
    const look = () => map.keepAbove(current.offsetHeight + 2 * BESIDE_PX);
    const watch = new ResizeObserver(look);
    watch.observe(current);
    return () => watch.disconnect();
  }, [map]);

  const present = useMemo(() => presentLayers(view), [view]);

  return (
    <section className={classes.frame} aria-label={texts.map.label(title)}>
      {/* biome-ignore-start lint/a11y/noNoninteractiveTabindex: arrow keys and zoom work while the map has the focus */}
      <div
        ref={target}
        className={classes.map}
        role="img"
        aria-label={texts.map.label(title)}
        aria-describedby={keysId}
        tabIndex={0}
        data-version={document.version}
      />
      {/* biome-ignore-end lint/a11y/noNoninteractiveTabindex: see above */}
      {map && over?.(map, hidden)}
      <p id={keysId} className="visually-hidden">
        {texts.map.keys}
      </p>
      <div className={classes.tools}>
        <Tool name="plus" label={texts.map.zoomIn} onClick={() => map?.zoomBy(1)} />
        <Tool name="minus" label={texts.map.zoomOut} onClick={() => map?.zoomBy(-1)} />
        <Tool name="fit" label={texts.map.fit} onClick={() => map?.fitWhole()} />
      </div>
      <LayersMenu
        present={present}
        scheme={scheme}
        hidden={hidden}
        onToggle={(layer) => setHidden((before) => toggled(before, layer))}
      />
      <div ref={below} className={classes.below}>
        {failed && (
          <p className={classes.failed} role="alert">
            {texts.map.gridFailed}
          </p>
        )}
        {children}
      </div>
    </section>
  );
}

interface ToolProps {
  readonly name: IconName;
  readonly label: string;
  readonly onClick: () => void;
}

function Tool({ name, label, onClick }: ToolProps) {
  return (
    <ActionIcon variant="default" size={44} aria-label={label} title={label} onClick={onClick}>
      <Icon name={name} />
    </ActionIcon>
  );
}

/** Layers that this map has anything in. */
function presentLayers(view: MapView): readonly Layer[] {
  const empty: Partial<Record<Layer, boolean>> = {
    rooms: view.rooms.length === 0,
    names: view.rooms.length === 0,
    walls: view.walls.length === 0,
    clutter: view.clutter.length === 0,
    dividers: view.dividers.length === 0,
    meta: view.metaDividers.length + view.metaOccupancy.length === 0,
    restrictions: view.restrictions.length + view.phantoms.length === 0,
    changed: view.changed.length === 0,
    proposed: view.proposed.length === 0,
  };
  return LAYERS.filter((layer) => !empty[layer]);
}

function toggled(layers: ReadonlySet<Layer>, layer: Layer): ReadonlySet<Layer> {
  const next = new Set(layers);
  if (!next.delete(layer)) next.add(layer);
  return next;
}
