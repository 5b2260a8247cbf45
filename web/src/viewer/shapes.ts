/** From the view model to OpenLayers features and styles. */

import Feature from "ol/Feature";
import LineString from "ol/geom/LineString";
import MultiLineString from "ol/geom/MultiLineString";
import Point from "ol/geom/Point";
import PolygonGeometry from "ol/geom/Polygon";
import Fill from "ol/style/Fill";
import StrokeStyle from "ol/style/Stroke";
import Style from "ol/style/Style";
import Text from "ol/style/Text";
import { roomFill, type Scheme } from "../map/colours";
import type { LineString as LineStringJson, Polygon as PolygonJson, Position, Ring } from "../map/document";
import { doorMark } from "../map/geometry";
import { type LabelPart, shownLabel } from "../map/labels";
import { MAP_STYLES, type Stroke as StrokeData, type Style as StyleData } from "../map/styles";
import type { MapView, RoomView } from "../map/view";
import { area } from "../texts";

/** Layers of shapes, from the bottom up. */
export const VECTOR_LAYERS = [
  "rooms",
  "clutter",
  "restrictions",
  "walls",
  "selection",
  "dividers",
  "meta",
  "changed",
  "proposed",
  "names",
] as const;
export type VectorLayerName = (typeof VECTOR_LAYERS)[number];
type Shapes = Readonly<Record<Exclude<VectorLayerName, "selection">, Feature[]>>;

const CHANGES = {
  opened: "gained",
  found: "gained",
  blocked: "lost",
  unseen: "lost",
  confirmed: "confirmed",
} as const;

const FONTS: Readonly<Record<LabelPart, string>> = {
  name: "600 15px 'Figtree Variable', sans-serif",
  area: "500 13px 'Figtree Variable', sans-serif",
};

export function shapes(view: MapView, scheme: Scheme): Shapes {
  const style = MAP_STYLES[scheme];
  return {
    rooms: view.rooms.map((room) =>
      styled(
        polygon(room.rings),
        toStyle({ fill: roomFill(room.slot, scheme) + style.roomAlpha, stroke: style.roomEdge }),
      ),
    ),
    clutter: view.clutter.map(({ geometry }) => styled(shape(geometry), toStyle(style.clutter))),
    restrictions: [
      ...view.phantoms.map(({ geometry }) => styled(shape(geometry), toStyle(style.phantom))),
      ...view.restrictions.map(({ geometry, properties }) => {
        const kind = { no_go: style.noGo, no_mop: style.noMop, virtual_wall: { stroke: style.virtualWall } }[
          properties.kind
        ];
        return styled(shape(geometry), toStyle(properties.placement === "placed" ? kind : unplaced(kind)));
      }),
    ],
    walls: view.walls.map(({ geometry, properties }) =>
      styled(shape(geometry), toStyle({ stroke: properties.kind === "open" ? style.wallOpen : style.wall })),
    ),
    dividers: view.dividers.map(({ geometry, properties }) => {
      if (properties.kind === "open") return styled(shape(geometry), toStyle({ stroke: style.dividerOpen }));
      const { leaf, arc } = doorMark(geometry.coordinates);
      return styled(lines([geometry.coordinates, leaf, arc]), toStyle({ stroke: style.dividerDoor }));
    }),
    meta: [
      ...view.metaOccupancy.map(({ geometry, properties }) =>
        styled(shape(geometry), toStyle(properties.cell === "occupied" ? style.metaOccupied : style.metaFree)),
      ),
      ...view.metaDividers.map(({ geometry }) => styled(shape(geometry), toStyle({ stroke: style.metaDivider }))),
    ],
    changed: view.changed.map(({ change, rings }) => styled(polygon(rings), toStyle(style[CHANGES[change]]))),
    proposed: view.proposed.map(({ geometry }) => styled(shape(geometry), toStyle({ stroke: style.proposed }))),
    names: names(view, scheme),
  };
}

/** One point a room, largest room first: where names would run into each other, the first one stays. */
function names(view: MapView, scheme: Scheme): Feature[] {
  const style = MAP_STYLES[scheme];
  const textStyle = new Text({
    fill: new Fill({ color: style.ink }),
    stroke: new StrokeStyle({ color: style.halo, width: 3 }),
    padding: [2, 4, 2, 4],
    overflow: true,
  });
  const named = new Style({ text: textStyle });
  return [...view.rooms]
    .sort((a, b) => b.area - a.area)
    .map((room) => {
      const feature = new Feature(new Point([...room.label.at]));
      const label = { name: room.name, area: area(room.area), spot: room.label };
      feature.setStyle((_, resolution) => {
        const shown = shownLabel(label, resolution, measure);
        if (!shown) return undefined;
        const name = [label.name, FONTS.name];
        textStyle.setText(shown.area ? [...name, "\n", "", label.area, FONTS.area] : name);
        textStyle.setScale(shown.scale);
        return named;
      });
      return feature;
    });
}

export function outline(room: RoomView, scheme: Scheme): Feature {
  return styled(polygon(room.rings), toStyle({ stroke: MAP_STYLES[scheme].selected }));
}

const pen = document.createElement("canvas").getContext("2d");

function measure(text: string, part: LabelPart): number {
  if (!pen) return 0;
  pen.font = FONTS[part];
  return pen.measureText(text).width;
}

type Shape = PolygonGeometry | LineString | MultiLineString;

function styled(geometry: Shape, style: Style): Feature {
  const feature = new Feature(geometry);
  feature.setStyle(style);
  return feature;
}

function shape(geometry: PolygonJson | LineStringJson): Shape {
  return geometry.type === "Polygon" ? polygon(geometry.coordinates) : new LineString(mutable(geometry.coordinates));
}

function polygon(rings: readonly Ring[]): PolygonGeometry {
  return new PolygonGeometry(rings.map(mutable));
}

function lines(parts: readonly (readonly Position[])[]): MultiLineString {
  return new MultiLineString(parts.map(mutable));
}

function mutable(points: readonly Position[]): number[][] {
  return points.map((point) => [...point]);
}

function toStyle({ fill, stroke }: StyleData): Style {
  return new Style({
    ...(fill && { fill: new Fill({ color: fill }) }),
    ...(stroke && {
      stroke: new StrokeStyle({
        color: stroke.colour,
        width: stroke.width,
        lineCap: stroke.dash ? "butt" : "round",
        lineJoin: "round",
        ...(stroke.dash && { lineDash: [...stroke.dash] }),
      }),
    }),
  });
}

function unplaced({ stroke }: { readonly stroke?: StrokeData }): StyleData {
  return stroke ? { stroke: { ...stroke, dash: [4, 6] } } : {};
}
