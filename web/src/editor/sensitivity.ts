/** How finely rooms are parted: what the service would do at a sensitivity, and what comes of it. Nothing here changes the map. */

import { answered, Problem } from "../api/client";
import type { MapDocument } from "../map/document";
import { byMission, type Entry } from "../map/history";
import type { Operations } from "../map/operations";
import { askSuggested, type Place, previewEdit } from "./calls";

export const RANGE = { min: -3, max: 3, step: 0.5 } as const;
const ATTEMPTS = 3;

/** Operations on a version, and the map that they come to. */
export interface Trial {
  readonly version: number;
  readonly operations: Operations;
  /** null: nothing would change. */
  readonly document: MapDocument | null;
}

/** What the rooms would be at a sensitivity. Throws `Problem`. */
export async function tryOut(place: Place, sensitivity: number, signal: AbortSignal): Promise<Trial> {
  for (let attempt = 0; attempt < ATTEMPTS; attempt++) {
    const suggested = await answered(askSuggested(place, sensitivity, signal));
    const { version } = suggested;
    const operations = suggested.operations as Operations;
    if (operations.length === 0) return { version, operations, document: null };
    const answer = await previewEdit(place, version, operations);
    if (answer.kind === "done") return { version, operations, document: answer.value as MapDocument };
    if (answer.kind === "unreachable") throw new Problem(0, "");
    // Stale: another version came into force between the two questions.
    if (answer.kind === "refused") throw new Problem(422, answer.problem.errors[0]?.detail ?? answer.problem.detail);
  }
  throw new Problem(412, "");
}

export interface Difference {
  readonly before: number;
  readonly after: number;
  /** Names that no room has any more, of rooms that would become part of another. */
  readonly lost: readonly string[];
}

export function differenceOf(before: MapDocument, after: MapDocument): Difference {
  const [was, is] = [roomsOf(before), roomsOf(after)];
  const lost = was.filter((name) => !is.includes(name) && !isNumber(name));
  return { before: was.length, after: is.length, lost: [...new Set(lost)].sort((a, b) => a.localeCompare(b)) };
}

/** Whether missions alone have made the map what it is. `entries`: of its whole history. */
export function isUntouched(entries: readonly Entry[]): boolean {
  const versions = entries.flatMap((entry) => (entry.kind === "version" ? [entry.version] : []));
  return versions.length > 0 && versions.every(byMission);
}

export const hasDrawn = ({ features }: MapDocument): boolean =>
  features.some(({ properties }) => properties.semantic === "divider" && properties.made_by === "user");

/** A room that nobody has named has no name to lose. */
const isNumber = (name: string): boolean => /^Room \d+$/.test(name);

/** By their names. */
export const roomsOf = ({ features }: MapDocument): string[] =>
  features.flatMap(({ properties }) => (properties.semantic === "room" ? [properties.name] : []));
