/** What can be answered to a question, as a person would say it: pure, from what the service proposes. */

import type { DividerFeature } from "../map/document";
import type { Operation } from "../map/operations";
import { type Conflict, isDiscovery, isDoor, isParked } from "../map/questions";

export type Response = "accept" | "reject" | "annotate" | "temporary";
/** In the texts under `answer` and `hint`. */
export type Saying =
  | "keep"
  | "takeNew"
  | "right"
  | "repaired"
  | "keepRepair"
  | "undoRepair"
  | "apart"
  | "together"
  | "wall"
  | "leave"
  | "isDoor"
  | "doorTo"
  | "noDoor"
  | "ownRoom"
  | "partOf"
  | "temporary"
  | "ignore";

export interface Answer {
  /** As in an address: `accept:p1`, `reject`, `temporary`, `door:d3`. */
  readonly key: string;
  readonly response: Response;
  readonly proposal: string | null;
  /** Done before it is decided. */
  readonly edit: Operation | null;
  readonly saying: Saying;
  /** Ids of the rooms that it speaks of. */
  readonly about: readonly string[];
  readonly recommended: boolean;
}

export interface Situation {
  /** Whether the mission's map is in force. */
  readonly taken: boolean;
  /** Dividers of the question that are open ways on the map in force. */
  readonly ways: readonly DividerFeature[];
  /** What a new room would be part of. */
  readonly neighbour: string | null;
}

/** More ways than this say nothing about which of them is a door. */
const MOST_WAYS = 3;

/** The recommended one first, what only puts it off last. */
export function answersTo(conflict: Conflict, situation: Situation): Answer[] {
  const proposals = [...conflict.proposals].sort((a, b) => Number(b.recommended) - Number(a.recommended));
  const accepting = proposals.map((proposal): Answer => {
    const saying = sayingOf(conflict, proposal.action, situation);
    const about = saying === "partOf" ? (situation.neighbour === null ? [] : [situation.neighbour]) : roomsOf(conflict);
    return answer(`accept:${proposal.id}`, "accept", saying, about, proposal.id, proposal.recommended);
  });
  return [...accepting, ...doors(conflict, situation), ...refusing(conflict, situation)];
}

function answer(
  key: string,
  response: Response,
  saying: Saying,
  about: readonly string[],
  proposal: string | null = null,
  recommended = false,
): Answer {
  return { key, response, proposal, edit: null, saying, about, recommended };
}

/** Those that did not come through; all, where none failed. */
function roomsOf({ rooms }: Conflict): string[] {
  const failed = rooms.filter(({ passed }) => !passed);
  return (failed.length > 0 ? failed : rooms).map(({ id }) => id);
}

const isSettled = (conflict: Conflict): boolean => conflict.default === null;

function sayingOf(conflict: Conflict, action: Conflict["proposals"][number]["action"], { taken }: Situation): Saying {
  if (isDiscovery(conflict)) return action === "keep_previous" ? "partOf" : "ownRoom";
  if (isDoor(conflict)) return action === "keep_previous" ? "noDoor" : "isDoor";
  const settled = isSettled(conflict);
  switch (action) {
    case "keep_previous":
      return "keep";
    case "take_new":
      if (settled) return "undoRepair";
      if (!taken) return "takeNew";
      return conflict.kind === "connectivity" ? "together" : "right";
    default:
      if (settled) return "keepRepair";
      if (!taken) return "repaired";
      return action === "meta_dividers" ? "apart" : "wall";
  }
}

/** Where a room seems lost behind a way that is shut, it may have a door. */
function doors(conflict: Conflict, { ways }: Situation): Answer[] {
  const isLost = conflict.kind === "room_lost" || conflict.kind === "room_recall";
  if (!isLost || conflict.cause === "new_passage" || ways.length > MOST_WAYS) return [];
  const keep = conflict.proposals.find(({ action }) => action === "keep_previous");
  if (!keep && !isSettled(conflict)) return [];
  const repair = conflict.proposals.find(({ action }) => action.startsWith("meta_"));
  const accepted = keep ?? repair;
  return ways.map(({ id, properties }) => ({
    ...answer(`door:${id}`, accepted ? "accept" : "reject", "doorTo", properties.rooms, accepted?.id ?? null),
    edit: { op: "set_divider_kind", id, kind: "door" },
  }));
}

function refusing(conflict: Conflict, { taken }: Situation): Answer[] {
  const offers = (action: string) => conflict.proposals.some((proposal) => proposal.action === action);
  const rooms = roomsOf(conflict);
  const temporary = answer("temporary", "temporary", "temporary", []);
  const reject = (saying: Saying) => answer("reject", "reject", saying, rooms);
  if (isParked(conflict)) return [reject("ignore")];
  if (isDiscovery(conflict)) return offers("keep_previous") ? [] : [reject("undoRepair")];
  if (isDoor(conflict)) return offers("keep_previous") ? [temporary] : [reject("noDoor")];
  if (isSettled(conflict)) return offers("take_new") || offers("keep_previous") ? [] : [reject("undoRepair")];
  if (offers("keep_previous")) return [temporary];
  if (conflict.kind === "drift") return [reject("leave")];
  return [reject(taken ? "leave" : "keep"), temporary];
}
