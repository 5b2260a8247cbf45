/** How each kind of thing on the map is drawn: data, so that the map, the thumbnails and the legend agree. */

import type { Scheme } from "./colours";

export type Layer =
  | "rooms"
  | "names"
  | "walls"
  | "clutter"
  | "dividers"
  | "meta"
  | "restrictions"
  | "changed"
  | "proposed"
  | "grid";

export interface Stroke {
  readonly colour: string;
  readonly width: number;
  readonly dash?: readonly number[];
}

export interface Style {
  readonly stroke?: Stroke;
  readonly fill?: string;
}

export interface MapStyles {
  readonly ink: string;
  readonly halo: string;
  readonly muted: string;
  readonly roomEdge: Stroke;
  /** Opacity of a room's fill over the floor, as two hexadecimal digits. */
  readonly roomAlpha: string;
  readonly selected: Stroke;
  readonly wall: Stroke;
  readonly wallOpen: Stroke;
  readonly clutter: Style;
  readonly dividerOpen: Stroke;
  readonly dividerDoor: Stroke;
  readonly metaDivider: Stroke;
  readonly metaOccupied: Style;
  readonly metaFree: Style;
  readonly noGo: Style;
  readonly noMop: Style;
  readonly virtualWall: Stroke;
  readonly phantom: Style;
  /** Floor that is lost, and floor that is new. */
  readonly lost: Style;
  readonly gained: Style;
  readonly confirmed: Style;
  readonly proposed: Stroke;
}

export const MAP_STYLES: Readonly<Record<Scheme, MapStyles>> = {
  light: {
    ink: "#2f2822",
    halo: "#fffdf8d9",
    muted: "#5b5046",
    roomEdge: { colour: "#5c4f4459", width: 1 },
    roomAlpha: "d0",
    selected: { colour: "#2c5f3e", width: 3.5 },
    wall: { colour: "#4a3f36", width: 2 },
    wallOpen: { colour: "#4a3f3666", width: 1.5, dash: [1, 5] },
    clutter: { fill: "#5c4f4440", stroke: { colour: "#5c4f4480", width: 1 } },
    dividerOpen: { colour: "#2c5f3e", width: 2, dash: [7, 6] },
    dividerDoor: { colour: "#2c5f3e", width: 1.5 },
    metaDivider: { colour: "#a33a1f", width: 2.5, dash: [2, 5] },
    metaOccupied: { fill: "#a33a1f4d", stroke: { colour: "#a33a1f", width: 1.5, dash: [3, 3] } },
    metaFree: { fill: "#fffdf899", stroke: { colour: "#a33a1f", width: 1.5, dash: [3, 3] } },
    noGo: { fill: "#b3261e2e", stroke: { colour: "#b3261e", width: 1.5 } },
    noMop: { fill: "#1f5fa32e", stroke: { colour: "#1f5fa3", width: 1.5 } },
    virtualWall: { colour: "#b3261e", width: 3 },
    phantom: { fill: "#f3ede3cc", stroke: { colour: "#5b5046", width: 1.5, dash: [1, 4] } },
    lost: { fill: "#b3541e59", stroke: { colour: "#b3541e", width: 2 } },
    gained: { fill: "#1f6f8b47", stroke: { colour: "#1f6f8b", width: 2 } },
    confirmed: { stroke: { colour: "#b3541e", width: 3, dash: [8, 6] } },
    proposed: { colour: "#7a1fa2", width: 4, dash: [10, 7] },
  },
  dark: {
    ink: "#f7efe4",
    halo: "#1b1815b3",
    muted: "#d6cabb",
    roomEdge: { colour: "#efe6da40", width: 1 },
    roomAlpha: "d0",
    selected: { colour: "#b9e0c4", width: 3.5 },
    wall: { colour: "#d8cab7", width: 2 },
    wallOpen: { colour: "#d8cab766", width: 1.5, dash: [1, 5] },
    clutter: { fill: "#efe6da33", stroke: { colour: "#efe6da80", width: 1 } },
    dividerOpen: { colour: "#c3e6cc", width: 2, dash: [7, 6] },
    dividerDoor: { colour: "#c3e6cc", width: 1.5 },
    metaDivider: { colour: "#ffb199", width: 2.5, dash: [2, 5] },
    metaOccupied: { fill: "#ffb19959", stroke: { colour: "#ffb199", width: 1.5, dash: [3, 3] } },
    metaFree: { fill: "#1b181599", stroke: { colour: "#ffb199", width: 1.5, dash: [3, 3] } },
    noGo: { fill: "#ff8a803d", stroke: { colour: "#ff8a80", width: 1.5 } },
    noMop: { fill: "#8ab8ff3d", stroke: { colour: "#8ab8ff", width: 1.5 } },
    virtualWall: { colour: "#ff8a80", width: 3 },
    phantom: { fill: "#1b1815cc", stroke: { colour: "#d6cabb", width: 1.5, dash: [1, 4] } },
    lost: { fill: "#ffae7a59", stroke: { colour: "#ffae7a", width: 2 } },
    gained: { fill: "#7fd0ea47", stroke: { colour: "#7fd0ea", width: 2 } },
    confirmed: { stroke: { colour: "#ffae7a", width: 3, dash: [8, 6] } },
    proposed: { colour: "#e3b3ff", width: 4, dash: [10, 7] },
  },
};
