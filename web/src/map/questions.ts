/** Questions of the service, told apart. */

import type { components } from "../api/schema.gen";

export type Conflict = components["schemas"]["ConflictDocument"];

/** A new room is on the map already: to be named, or to be part of its neighbour. */
export const isDiscovery = ({ kind, cause, default: asked }: Conflict): boolean =>
  kind === "connectivity" && cause === "new_passage" && asked === null;

/** A divider that was shut and is open again. */
export const isDoor = ({ kind, cause }: Conflict): boolean => kind === "connectivity" && cause === "door_closed";

/** Whether it is answered by saying which floor a mission belongs to. */
export const isParked = ({ kind }: Conflict): boolean => kind === "wrong_map";

export const ofMap = (conflicts: readonly Conflict[], robot: string, map: string): Conflict[] =>
  conflicts.filter((one) => one.robot === robot && one.map === map);
