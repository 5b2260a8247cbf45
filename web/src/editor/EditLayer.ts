/** Drawing and moving on the map: pointer, touch and keys in, shapes out. Shows what is about to be; changes nothing itself. */

import Feature from "ol/Feature";
import LineString from "ol/geom/LineString";
import Point from "ol/geom/Point";
import PolygonGeometry from "ol/geom/Polygon";
import DoubleClickZoom from "ol/interaction/DoubleClickZoom";
import PointerInteraction from "ol/interaction/Pointer";
import VectorLayer from "ol/layer/Vector";
import type OlMap from "ol/Map";
import type MapBrowserEvent from "ol/MapBrowserEvent";
import VectorSource from "ol/source/Vector";
import CircleStyle from "ol/style/Circle";
import Fill from "ol/style/Fill";
import Stroke from "ol/style/Stroke";
import Style from "ol/style/Style";
import Text from "ol/style/Text";
import type { Scheme } from "../map/colours";
import type { MapDocument, Position, Ring } from "../map/document";
import { labelSpot } from "../map/geometry";
import type { Line } from "../map/operations";
import { mayCut } from "../map/project";
import { attach, gap, nearestOn, type Segment, snap } from "../map/snap";
import { areaOf, splitRoom } from "../map/split";
import { area } from "../texts";
import {
  barriers,
  drawsLine,
  pick,
  rectangle,
  type Selection,
  type ShapeChange,
  shapeOf,
  shifted,
  type Tool,
} from "./targets";

/** A finger is not a mouse. */
const REACH_PX = { mouse: 12, touch: 26 } as const;
const SNAP_PX = { mouse: 16, touch: 30 } as const;
/** Moved farther than this between down and up, it was a drag. */
const DRAG_PX = 10;
const STEP_PX = 12;
const NUDGE_M = 0.05;
const FINE_M = 0.01;

export interface Context {
  readonly document: MapDocument;
  readonly tool: Tool;
  readonly selection: Selection;
  readonly scheme: Scheme;
}

export interface Part {
  readonly room: string;
  readonly areas: readonly number[];
}

export interface EditLayerEvents {
  onPick(selection: Selection): void;
  /** Two points, end to end or corner to corner. */
  onDraw(tool: Tool, from: Position, to: Position): void;
  onMove(selection: NonNullable<Selection>, change: ShapeChange): void;
  /** Rooms that the line which is being drawn would divide. */
  onParts(parts: readonly Part[]): void;
  onFirst(at: Position | null): void;
}

interface Grip {
  readonly selection: NonNullable<Selection>;
  readonly shape: readonly Position[];
  /** The corner that is held; null: the whole. */
  readonly corner: number | null;
  readonly from: Position;
}

const COLOURS = {
  light: { ink: "#1d4d31", bad: "#b3261e", halo: "#fffdf8", parts: ["#2c5f3e55", "#d08a1d55", "#3f6fb355"] },
  dark: { ink: "#c9f0d4", bad: "#ff8a80", halo: "#1b1815", parts: ["#b1d9bd55", "#ffcf8055", "#9cc3ff55"] },
} as const;

export class EditLayer {
  private context: Context | null = null;
  private segments: Segment[] = [];
  private first: Position | null = null;
  private cursor: Position | null = null;
  private grip: Grip | null = null;
  private moved: readonly Position[] | null = null;
  /** Two fingers move the map, whatever the tool. */
  private pinched = false;
  private downAt: readonly number[] | null = null;
  private readonly source = new VectorSource();
  private readonly layer: VectorLayer<VectorSource>;
  private readonly interaction: PointerInteraction;
  private readonly target: HTMLElement;
  private saidParts = "";

  constructor(
    private readonly map: OlMap,
    private readonly events: EditLayerEvents,
  ) {
    this.layer = new VectorLayer({ source: this.source, updateWhileAnimating: true, updateWhileInteracting: true });
    this.interaction = new PointerInteraction({
      handleDownEvent: (event) => this.down(event),
      handleDragEvent: (event) => this.drag(event),
      handleUpEvent: (event) => this.up(event),
      handleMoveEvent: (event) => this.move(event),
    });
    map.addLayer(this.layer);
    map.addInteraction(this.interaction);
    map.on("click", this.click);
    this.target = map.getTargetElement() as HTMLElement;
    this.target.addEventListener("keydown", this.key, { capture: true });
  }

  dispose(): void {
    this.target.removeEventListener("keydown", this.key, { capture: true });
    this.target.style.cursor = "";
    this.map.un("click", this.click);
    this.zoomByTaps(true);
    this.map.removeInteraction(this.interaction);
    this.map.removeLayer(this.layer);
    this.layer.dispose();
  }

  show(context: Context): void {
    if (context.tool !== this.context?.tool) this.forget();
    this.context = context;
    this.segments = barriers(context.document);
    this.moved = null;
    this.target.style.cursor = context.tool === "select" ? "" : "crosshair";
    this.zoomByTaps(context.tool === "select");
    this.draw();
  }

  /** Gives up what is being drawn. Answers with whether there was anything. */
  cancel(): boolean {
    const had = this.first !== null || this.grip !== null;
    this.forget();
    this.draw();
    return had;
  }

  private forget(): void {
    this.first = null;
    this.grip = null;
    this.moved = null;
    this.events.onFirst(null);
    this.sayParts([]);
  }

  // -- pointer -------------------------------------------------------------------------------------------------------

  private readonly click = (event: MapBrowserEvent): void => {
    if (this.context?.tool !== "select") return;
    this.events.onPick(pick(this.context.document, at(event.coordinate), this.metres(REACH_PX[sort(event)])));
  };

  /** Two quick taps set two points while drawing. */
  private zoomByTaps(active: boolean): void {
    for (const one of this.map.getInteractions().getArray()) {
      if (one instanceof DoubleClickZoom) one.setActive(active);
    }
  }

  private metres(px: number): number {
    return px * (this.map.getView().getResolution() ?? 0.01);
  }

  private snapped(event: MapBrowserEvent, except?: string): Position {
    const point = at(event.coordinate);
    const segments = except && this.context ? barriers(this.context.document, except) : this.segments;
    return snap(point, segments, this.metres(SNAP_PX[sort(event)])).at;
  }

  private down(event: MapBrowserEvent): boolean {
    if (!this.context || this.interaction.getPointerCount() > 1) return false;
    const { tool } = this.context;
    this.downAt = event.pixel;
    if (tool === "select") {
      this.grip = this.gripAt(at(event.coordinate), this.metres(REACH_PX[sort(event)]));
      return this.grip !== null;
    }
    this.cursor = this.snapped(event);
    this.draw();
    return true;
  }

  private drag(event: MapBrowserEvent): void {
    if (!this.context) return;
    if (this.interaction.getPointerCount() > 1) {
      this.pinched = true;
      this.cancel();
      return;
    }
    if (this.grip) {
      this.moved = this.gripped(this.grip, event);
    } else {
      if (this.first === null && this.isDrag(event) && this.cursor) this.begin(this.cursor);
      this.cursor = this.snapped(event);
    }
    this.draw();
  }

  private up(event: MapBrowserEvent): boolean {
    if (!this.context) return false;
    const { grip, moved } = this;
    if (grip) {
      this.grip = null;
      if (moved && this.isDrag(event)) this.events.onMove(grip.selection, () => moved);
      else this.moved = null;
      this.draw();
      return false;
    }
    if (this.pinched) {
      this.pinched = false;
      return false;
    }
    this.tap(this.snapped(event), this.isDrag(event));
    return false;
  }

  private move(event: MapBrowserEvent): void {
    if (!this.context || this.context.tool === "select" || event.dragging) return;
    if (sort(event) === "touch") return;
    this.cursor = this.snapped(event);
    this.draw();
  }

  private isDrag(event: MapBrowserEvent): boolean {
    const [x = 0, y = 0] = this.downAt ?? event.pixel;
    return Math.hypot((event.pixel[0] ?? 0) - x, (event.pixel[1] ?? 0) - y) > DRAG_PX;
  }

  private begin(point: Position): void {
    this.first = point;
    this.events.onFirst(point);
  }

  /** The first point, or the second, which ends the drawing. */
  private tap(point: Position, wasDrag = false): void {
    if (!this.context) return;
    const { first } = this;
    this.cursor = point;
    if (first === null) {
      if (!wasDrag) this.begin(point);
    } else if (gap(first, point) > this.metres(DRAG_PX / 2)) {
      this.forget();
      this.events.onDraw(this.context.tool, first, point);
    }
    this.draw();
  }

  /** A tap on what is selected or beside it takes hold of it; anywhere else it pans the map or selects. */
  private gripAt(point: Position, reach: number): Grip | null {
    const { document, selection } = this.context ?? {};
    const shape = document && shapeOf(document, selection ?? null);
    if (!shape || !selection) return null;
    const corner = shape.findIndex((one) => gap(one, point) <= reach);
    if (corner >= 0) return { selection, shape, corner, from: point };
    const closed = shape.length > 2 && shape[0] ? [...shape, shape[0]] : shape;
    const isNear = closed.slice(1).some((b, i) => gap(nearestOn([closed[i] ?? b, b], point), point) <= reach);
    return isNear ? { selection, shape, corner: null, from: point } : null;
  }

  private gripped({ selection, shape, corner, from }: Grip, event: MapBrowserEvent): readonly Position[] {
    if (corner === null) {
      const [x, y] = at(event.coordinate);
      return shifted(shape, [x - from[0], y - from[1]]);
    }
    const point = this.snapped(event, selection.id);
    return shape.map((one, i) => (i === corner ? point : one));
  }

  // -- keys ----------------------------------------------------------------------------------------------------------

  private readonly key = (event: KeyboardEvent): void => {
    if (!this.context || event.ctrlKey || event.metaKey || event.altKey) return;
    const handled = this.context.tool === "select" ? this.nudge(event) : this.steer(event);
    if (!handled) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  };

  /** Arrow keys move what is selected by 5 cm, with Shift by 1 cm. */
  private nudge(event: KeyboardEvent): boolean {
    const { document, selection } = this.context ?? {};
    const shape = document && shapeOf(document, selection ?? null);
    const arrow = ARROWS[event.key];
    if (!shape || !selection || !arrow) return false;
    const step = event.shiftKey ? FINE_M : NUDGE_M;
    this.events.onMove(selection, (now) => shifted(now, [arrow[0] * step, arrow[1] * step]));
    return true;
  }

  /** A crosshair by arrow keys; Enter sets a point. */
  private steer(event: KeyboardEvent): boolean {
    const arrow = ARROWS[event.key];
    const centre = this.map.getView().getCenter();
    this.cursor ??= at(centre ?? [0, 0]);
    if (arrow) {
      const step = this.metres(event.shiftKey ? 2 : STEP_PX);
      this.cursor = [this.cursor[0] + arrow[0] * step, this.cursor[1] + arrow[1] * step];
      this.draw();
      return true;
    }
    if (event.key !== "Enter" && event.key !== " ") return false;
    this.tap(snap(this.cursor, this.segments, this.metres(SNAP_PX.touch)).at);
    return true;
  }

  // -- what is shown -------------------------------------------------------------------------------------------------

  private draw(): void {
    if (!this.context) return;
    const { tool, selection, document, scheme } = this.context;
    const colours = COLOURS[scheme];
    const features: Feature[] = [];
    const shape = this.moved ?? shapeOf(document, selection);
    if (tool === "select") {
      if (shape && selection) {
        features.push(styled(outlineOf(shape), stroke(colours.ink, 4)));
        for (const point of shape) features.push(styled(new Point([...point]), handle(colours.ink, colours.halo)));
        if (this.moved && selection.sort === "divider") {
          const [from, to] = this.moved;
          if (from && to) features.push(...this.parts([from, to], colours, selection.id));
        }
      }
    } else if (this.cursor) {
      const snapped = snap(this.cursor, this.segments, this.metres(2));
      if (this.first) features.push(...this.drawn(tool, this.first, this.cursor, colours));
      const isOn = drawsLine(tool) && snapped.onto !== null;
      features.push(styled(new Point([...this.cursor]), ring(isOn ? colours.ink : colours.halo, colours.ink, isOn)));
    }
    this.source.clear(true);
    this.source.addFeatures(features);
  }

  private drawn(tool: Tool, from: Position, to: Position, colours: (typeof COLOURS)[Scheme]): Feature[] {
    if (tool === "divider") return this.parts([from, to], colours);
    const points = drawsLine(tool) ? [from, to] : rectangle(from, to);
    return [styled(outlineOf(points), stroke(colours.ink, 3), colours.parts[0])];
  }

  /** A divider and the rooms that it would make, with their areas; in red what would be refused. */
  private parts(line: Line, colours: (typeof COLOURS)[Scheme], except?: string): Feature[] {
    if (!this.context) return [];
    const { document } = this.context;
    const found = attach(line, except ? barriers(document, except) : this.segments);
    if (!found.ok) {
      this.sayParts([]);
      const loose = line[found.end];
      return [
        styled(outlineOf(line), stroke(colours.bad, 3, [6, 6])),
        styled(new Point([...loose]), ring(colours.halo, colours.bad, true)),
      ];
    }
    const features: Feature[] = [];
    const said: Part[] = [];
    for (const { geometry, properties } of document.features) {
      if (except || properties.semantic !== "room" || geometry.type !== "Polygon") continue;
      if (!mayCut(geometry.coordinates, found.line)) continue;
      const parts = splitRoom(geometry.coordinates, found.line);
      if (parts.length < 2) continue;
      said.push({ room: properties.name, areas: parts.map(areaOf) });
      for (const [i, rings] of parts.entries()) {
        features.push(...part(rings, colours.parts[i % colours.parts.length] ?? "", colours));
      }
    }
    this.sayParts(said);
    features.push(styled(outlineOf(found.line), stroke(colours.ink, 4)));
    for (const end of found.line) features.push(styled(new Point([...end]), handle(colours.ink, colours.halo)));
    return features;
  }

  private sayParts(parts: readonly Part[]): void {
    const text = JSON.stringify(parts.map(({ room, areas }) => [room, areas.map((size) => size.toFixed(1))]));
    if (text === this.saidParts) return;
    this.saidParts = text;
    this.events.onParts(parts);
  }
}

const ARROWS: Readonly<Record<string, Position>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

const at = ([x = 0, y = 0]: readonly number[]): Position => [x, y];

function sort(event: MapBrowserEvent): "mouse" | "touch" {
  const { originalEvent } = event;
  return "pointerType" in originalEvent && originalEvent.pointerType === "touch" ? "touch" : "mouse";
}

function outlineOf(points: readonly Position[]): LineString | PolygonGeometry {
  const coordinates = points.map((point) => [...point]);
  return points.length === 2 ? new LineString(coordinates) : new PolygonGeometry([coordinates]);
}

function styled(geometry: LineString | PolygonGeometry | Point, style: Style, fill?: string): Feature {
  const feature = new Feature(geometry);
  if (fill) style.setFill(new Fill({ color: fill }));
  feature.setStyle(style);
  return feature;
}

function stroke(colour: string, width: number, dash?: number[]): Style {
  return new Style({ stroke: new Stroke({ color: colour, width, lineCap: "round", ...(dash && { lineDash: dash }) }) });
}

function handle(colour: string, halo: string): Style {
  const circle = { radius: 8, fill: new Fill({ color: halo }), stroke: new Stroke({ color: colour, width: 3 }) };
  return new Style({ image: new CircleStyle(circle) });
}

/** The snapping ring: filled while the point lies on a wall or divider. */
function ring(fill: string, colour: string, isOn: boolean): Style {
  const circle = {
    radius: isOn ? 11 : 8,
    fill: new Fill({ color: `${fill}${isOn ? "66" : "99"}` }),
    stroke: new Stroke({ color: colour, width: isOn ? 3 : 2 }),
  };
  return new Style({ image: new CircleStyle(circle), zIndex: 2 });
}

function part(
  rings: readonly Ring[],
  fill: string,
  colours: { readonly ink: string; readonly halo: string },
): Feature[] {
  const shape = new PolygonGeometry(rings.map((one) => one.map((point) => [...point])));
  const label = new Text({
    text: area(areaOf(rings)),
    font: "600 15px 'Figtree Variable', sans-serif",
    fill: new Fill({ color: colours.ink }),
    stroke: new Stroke({ color: colours.halo, width: 4 }),
    overflow: true,
  });
  return [
    styled(shape, new Style({ fill: new Fill({ color: fill }) })),
    styled(new Point([...labelSpot(rings).at]), new Style({ text: label, zIndex: 3 })),
  ];
}
