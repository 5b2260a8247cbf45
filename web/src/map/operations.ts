/** What can be asked of a map, and a draft of it: pure actions from one list of operations to the next. */

import type { components } from "../api/schema.gen";
import type { Position } from "./document";

type Schemas = components["schemas"];

export type Operation = Schemas["EditRequest"]["operations"][number];
export type Operations = readonly Operation[];
export type DividerKind = Schemas["AddDivider"]["kind"];
export type RestrictionKind = Schemas["AddRestriction"]["kind"];
export type RoomKind = NonNullable<Schemas["SetRoomKind"]["kind"]>;
export type Line = readonly [Position, Position];

/** A feature of the map in force, or what operation `index` of the draft makes. */
export type Ref = { readonly id: string } | { readonly index: number };
/** A room by its id, or, for one that the draft itself makes, by a point in it. */
export type RoomRef = { readonly id: string } | { readonly at: Position };

export const isMade = (ref: Ref): ref is { readonly index: number } => "index" in ref;

const pair = ([x, y]: Position): [number, number] => [round(x), round(y)];
const round = (metres: number): number => Math.round(metres * 1000) / 1000;
const pairs = ([a, b]: Line): [[number, number], [number, number]] => [pair(a), pair(b)];
const ring = (shape: readonly Position[]): [number, number][] => shape.map(pair);

function replaced(operations: Operations, index: number, operation: Operation): Operations {
  return operations.map((one, i) => (i === index ? operation : one));
}

const without = (operations: Operations, index: number): Operations => operations.filter((_, i) => i !== index);

/** Takes the place of an earlier operation of the same sort on the same thing, or comes after all others. */
function said(operations: Operations, operation: Operation, isSame: (other: Operation) => boolean): Operations {
  const index = operations.findIndex(isSame);
  return index < 0 ? [...operations, operation] : replaced(operations, index, operation);
}

export function addDivider(operations: Operations, line: Line, kind: DividerKind = "open"): Operations {
  return [...operations, { op: "add_divider", line: pairs(line), kind }];
}

export function moveDivider(operations: Operations, ref: Ref, line: Line): Operations {
  if (!isMade(ref)) {
    return said(
      operations,
      { op: "move_divider", id: ref.id, line: pairs(line) },
      (other) => other.op === "move_divider" && other.id === ref.id,
    );
  }
  const made = operations[ref.index];
  return made?.op === "add_divider" ? replaced(operations, ref.index, { ...made, line: pairs(line) }) : operations;
}

/** What was only drawn in this draft was never there: its operation goes. Else nothing more needs to be said of the divider before. */
export function removeDivider(operations: Operations, ref: Ref): Operations {
  if (isMade(ref)) return operations[ref.index]?.op === "add_divider" ? without(operations, ref.index) : operations;
  const others = operations.filter(
    (other) => !((other.op === "move_divider" || other.op === "set_divider_kind") && other.id === ref.id),
  );
  return said(
    others,
    { op: "remove_divider", id: ref.id },
    (other) => other.op === "remove_divider" && other.id === ref.id,
  );
}

export function setDividerKind(operations: Operations, ref: Ref, kind: DividerKind): Operations {
  if (!isMade(ref)) {
    return said(
      operations,
      { op: "set_divider_kind", id: ref.id, kind },
      (other) => other.op === "set_divider_kind" && other.id === ref.id,
    );
  }
  const made = operations[ref.index];
  return made?.op === "add_divider" ? replaced(operations, ref.index, { ...made, kind }) : operations;
}

export function acceptRepair(operations: Operations, id: string): Operations {
  return said(
    operations,
    { op: "accept_meta_divider", id },
    (other) => other.op === "accept_meta_divider" && other.id === id,
  );
}

const roomFields = (room: RoomRef) => ("id" in room ? { id: room.id, at: null } : { id: null, at: pair(room.at) });

function isAbout(operation: Operation, op: "rename_room" | "set_room_kind" | "pin_room", room: RoomRef): boolean {
  if (operation.op !== op) return false;
  const { id, at } = roomFields(room);
  return id === null ? operation.at?.join() === at?.join() : operation.id === id;
}

export function renameRoom(operations: Operations, room: RoomRef, name: string): Operations {
  const operation: Operation = { op: "rename_room", ...roomFields(room), name };
  return said(operations, operation, (other) => isAbout(other, "rename_room", room));
}

export function setRoomKind(operations: Operations, room: RoomRef, kind: RoomKind | null): Operations {
  const operation: Operation = { op: "set_room_kind", ...roomFields(room), kind };
  return said(operations, operation, (other) => isAbout(other, "set_room_kind", room));
}

export function pinRoom(operations: Operations, room: RoomRef, pinned: boolean): Operations {
  const operation: Operation = { op: "pin_room", ...roomFields(room), pinned };
  return said(operations, operation, (other) => isAbout(other, "pin_room", room));
}

export function mergeRooms(operations: Operations, ids: readonly string[]): Operations {
  return [...operations, { op: "merge_rooms", ids: [...ids] }];
}

export function addRestriction(operations: Operations, kind: RestrictionKind, shape: readonly Position[]): Operations {
  return [...operations, { op: "add_restriction", kind, shape: ring(shape) }];
}

export function moveRestriction(operations: Operations, ref: Ref, shape: readonly Position[]): Operations {
  if (!isMade(ref)) {
    return said(
      operations,
      { op: "move_restriction", id: ref.id, shape: ring(shape) },
      (other) => other.op === "move_restriction" && other.id === ref.id,
    );
  }
  const made = operations[ref.index];
  return made?.op === "add_restriction" ? replaced(operations, ref.index, { ...made, shape: ring(shape) }) : operations;
}

export function removeRestriction(operations: Operations, ref: Ref): Operations {
  if (isMade(ref)) return operations[ref.index]?.op === "add_restriction" ? without(operations, ref.index) : operations;
  const others = operations.filter((other) => !(other.op === "move_restriction" && other.id === ref.id));
  return said(
    others,
    { op: "remove_restriction", id: ref.id },
    (other) => other.op === "remove_restriction" && other.id === ref.id,
  );
}

export function markPhantom(operations: Operations, shape: readonly Position[]): Operations {
  return [...operations, { op: "mark_phantom", shape: ring(shape) }];
}

export function removePhantom(operations: Operations, ref: Ref): Operations {
  if (isMade(ref)) return operations[ref.index]?.op === "mark_phantom" ? without(operations, ref.index) : operations;
  return said(
    operations,
    { op: "remove_phantom", id: ref.id },
    (other) => other.op === "remove_phantom" && other.id === ref.id,
  );
}

/** A fix that the service offers: in the place of the operation that it mends, or besides all others. */
export function applyFix(operations: Operations, pointer: string, operation: Operation): Operations {
  const index = /^\/operations\/(\d+)$/.exec(pointer)?.[1];
  return index === undefined ? [...operations, operation] : replaced(operations, Number(index), operation);
}

/** The operation of the draft that made a feature, by what the preview says of it. */
export function indexOfMade(made: readonly { pointer: string; feature: string }[], id: string): number | null {
  const pointer = made.find(({ feature }) => feature === id)?.pointer;
  const index = pointer === undefined ? undefined : /^\/operations\/(\d+)$/.exec(pointer)?.[1];
  return index === undefined ? null : Number(index);
}
