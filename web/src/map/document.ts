/** The map document of the HTTP contract: GeoJSON in local metres, x right, y up. */

import type { components } from "../api/schema.gen";

type Schemas = components["schemas"];

export type Position = readonly [number, number];
export type Ring = readonly Position[];
export type Polygon = Schemas["Polygon"];
export type LineString = Schemas["LineString"];
export type RoomFeature = Schemas["RoomFeature"];
export type DividerFeature = Schemas["DividerFeature"];
export type WallFeature = Schemas["WallFeature"];
export type ClutterFeature = Schemas["ClutterFeature"];
export type MetaDividerFeature = Schemas["MetaDividerFeature"];
export type MetaOccupancyFeature = Schemas["MetaOccupancyFeature"];
export type RestrictionFeature = Schemas["RestrictionFeature"];
export type PhantomFeature = Schemas["PhantomFeature"];
export type MapDocument = Schemas["MapDocument"];
export type MapFeature = MapDocument["features"][number];
export type Frame = Schemas["Frame"];
export type Cause = MapDocument["cause"];
