/** The map on the screen: a thin, imperative shell around OpenLayers. What is shown comes from the view model; nothing is read back. */

import { noModifierKeys } from "ol/events/condition";
import type Feature from "ol/Feature";
import DoubleClickZoom from "ol/interaction/DoubleClickZoom";
import DragPan from "ol/interaction/DragPan";
import KeyboardPan from "ol/interaction/KeyboardPan";
import KeyboardZoom from "ol/interaction/KeyboardZoom";
import MouseWheelZoom from "ol/interaction/MouseWheelZoom";
import PinchZoom from "ol/interaction/PinchZoom";
import Kinetic from "ol/Kinetic";
import VectorLayer from "ol/layer/Vector";
import OlMap from "ol/Map";
import Projection from "ol/proj/Projection";
import VectorSource from "ol/source/Vector";
import View from "ol/View";
import type { Scheme } from "../map/colours";
import type { Bounds } from "../map/geometry";
import type { Layer } from "../map/styles";
import { type MapView, roomAt } from "../map/view";
import { GridLayer, type GridPicture } from "./GridLayer";
import { outline, shapes, VECTOR_LAYERS, type VectorLayerName } from "./shapes";

const METRES = new Projection({ code: "stillroom:home", units: "m" });
/** Room for what lies over the map, at the top, right and left: tools beside it on wide screens, above it on narrow ones. */
const FIT_PADDING_PX = { wide: [40, 84, 40], narrow: [70, 16, 16] } as const;
const LEAST_BELOW_PX = 16;
const NARROW_PX = 600;
const CLOSEST_M_PER_PX = 0.003;
/** How far out one can zoom: the home is then this share of the size that fits. */
const FARTHEST = 0.25;
const EASE_MS = 220;

export class HomeMap {
  /** For layers of others, such as the editor's. */
  readonly map: OlMap;
  /** Whether a tap on a room selects it. */
  picks = true;
  private readonly grid = new GridLayer();
  private readonly vectors: Readonly<Record<VectorLayerName, VectorLayer<VectorSource>>>;
  private readonly easeMs: number;
  private view: MapView | null = null;
  private scheme: Scheme = "light";
  private selected: string | null = null;
  /** Whether a person has moved the map; until then it follows the size of the window. */
  private moved = false;
  /** Pixels of the lower edge that something lies over. */
  private below = LEAST_BELOW_PX;

  constructor(target: HTMLElement, onSelect: (roomId: string | null) => void) {
    this.easeMs = matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : EASE_MS;
    const vectors = VECTOR_LAYERS.map((name) => [name, vectorLayer(name)] as const);
    this.vectors = Object.fromEntries(vectors) as typeof this.vectors;
    this.map = new OlMap({
      target,
      controls: [],
      interactions: this.interactions(),
      layers: [this.grid, ...vectors.map(([, layer]) => layer)],
    });
    this.map.on("singleclick", ({ coordinate }) => this.picks && onSelect(this.roomIdAt(coordinate)));
    this.map.on("pointermove", ({ coordinate, dragging }) => {
      if (!dragging && this.picks) target.style.cursor = this.roomIdAt(coordinate) === null ? "" : "pointer";
    });
    this.map.on("change:size", () => {
      if (!this.moved) this.fit(0);
    });
    const moved = () => {
      this.moved = true;
    };
    this.map.on("pointerdrag", moved);
    target.addEventListener("wheel", moved, { passive: true });
    target.addEventListener("keydown", moved);
  }

  dispose(): void {
    this.map.setTarget(undefined);
    this.map.dispose();
  }

  show(view: MapView, scheme: Scheme): void {
    const first = this.view === null;
    this.view = view;
    this.scheme = scheme;
    for (const [name, features] of Object.entries(shapes(view, scheme)))
      this.replace(name as VectorLayerName, features);
    this.drawSelection();
    this.holdView(view.bounds);
    if (first || !this.moved) this.fit(0);
  }

  showGrid(picture: GridPicture | null): void {
    this.grid.show(picture);
  }

  setVisible(layer: Layer, visible: boolean): void {
    (layer === "grid" ? this.grid : this.vectors[layer]).setVisible(visible);
  }

  /** Marks a room; `centre` also brings it into the middle, as after a choice in the list. */
  select(roomId: string | null, centre: boolean): void {
    this.selected = roomId;
    const room = this.drawSelection();
    if (room && centre) {
      this.moved = true;
      this.map.getView().animate({ center: [...room.label.at], duration: this.easeMs });
    }
  }

  /** Shows what the view says is to be shown first. */
  fit(duration: number = this.easeMs): void {
    if (this.view && this.fitTo(this.view.focus ?? this.view.bounds, duration)) this.moved = false;
  }

  /** Shows all of it. */
  fitWhole(): void {
    if (!this.view) return;
    this.fitTo(this.view.bounds, this.easeMs);
    this.moved = this.view.focus !== null;
  }

  fitTo(bounds: Bounds, duration: number = this.easeMs): boolean {
    const [width = 0, height = 0] = this.map.getSize() ?? [];
    if (width === 0 || height === 0) return false;
    const [top, right, left] = FIT_PADDING_PX[width < NARROW_PX ? "narrow" : "wide"];
    const padding = [top, right, this.below, left];
    this.map.getView().fit([...bounds], { size: [width, height], padding, duration });
    this.moved = true;
    return true;
  }

  /** Keeps what is shown above what lies over the lower edge. */
  keepAbove(pixels: number): void {
    this.below = Math.max(LEAST_BELOW_PX, pixels);
    if (!this.moved) this.fit(0);
  }

  /** Shows the same part as another one. Answers with the function that ends it. */
  follow(other: HomeMap): () => void {
    const look = () => {
      this.moved = true;
      this.map.setView(other.map.getView());
    };
    look();
    other.map.on("change:view", look);
    return () => other.map.un("change:view", look);
  }

  zoomBy(levels: number): void {
    this.moved = true;
    const view = this.map.getView();
    const zoom = view.getZoom();
    if (zoom !== undefined) view.animate({ zoom: zoom + levels, duration: this.easeMs });
  }

  private interactions() {
    const duration = this.easeMs;
    const still = duration === 0;
    return [
      new DragPan(still ? {} : { kinetic: new Kinetic(-0.005, 0.05, 100) }),
      new PinchZoom({ duration }),
      new MouseWheelZoom({ duration }),
      new DoubleClickZoom({ duration }),
      new KeyboardPan({ duration: Math.min(duration, 100), condition: noModifierKeys }),
      new KeyboardZoom({ duration: Math.min(duration, 100) }),
    ];
  }

  private roomIdAt([x = 0, y = 0]: number[]): string | null {
    return (this.view && roomAt(this.view, [x, y])?.id) ?? null;
  }

  private replace(name: VectorLayerName, features: Feature[]): void {
    const source = this.vectors[name].getSource();
    source?.clear(true);
    source?.addFeatures(features);
  }

  private drawSelection() {
    const room = this.view?.rooms.find(({ id }) => id === this.selected);
    this.replace("selection", room ? [outline(room, this.scheme)] : []);
    return room;
  }

  /** Keeps the middle of the screen near the home, so that nobody gets lost; a map that moved gets new limits and the old zoom. */
  private holdView([west, south, east, north]: Bounds): void {
    const before = this.map.getView();
    const margin = Math.max(east - west, north - south, 1) / 4;
    const extent = [west - margin, south - margin, east + margin, north + margin];
    const [width = 0, height = 0] = this.map.getSize() ?? [];
    const fitting = Math.max(
      (east - west) / Math.max(width, 100),
      (north - south) / Math.max(height, 100),
      CLOSEST_M_PER_PX,
    );
    const view = new View({
      projection: METRES,
      extent,
      constrainOnlyCenter: true,
      enableRotation: false,
      showFullExtent: true,
      minResolution: CLOSEST_M_PER_PX,
      maxResolution: fitting / FARTHEST,
      center: before.getCenter() ?? [(west + east) / 2, (south + north) / 2],
      resolution: before.getResolution() ?? fitting,
    });
    this.map.setView(view);
  }
}

function vectorLayer(name: VectorLayerName): VectorLayer<VectorSource> {
  return new VectorLayer({
    source: new VectorSource(),
    declutter: name === "names",
    updateWhileAnimating: true,
    updateWhileInteracting: true,
  });
}
