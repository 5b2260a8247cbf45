/** Versions and missions as one line of time. */

import type { components } from "../api/schema.gen";

export type Version = components["schemas"]["VersionListItem"];
export type Mission = components["schemas"]["MissionDocument"];

/** A version with the mission that caused it, or a mission that changed nothing (or has not been worked on yet). */
export type Entry =
  | { readonly kind: "version"; readonly at: string; readonly version: Version; readonly mission: Mission | null }
  | { readonly kind: "mission"; readonly at: string; readonly mission: Mission };

/** Items read so far, the newest first; `more`: there are older ones. */
export interface Loaded<Item> {
  readonly items: readonly Item[];
  readonly more: boolean;
}

/**
 * The newest first. While one of the lists has older items that were not read yet, entries of the other that lie before
 * its end are held back, so that reading on never puts an entry in between.
 */
export function timeline(versions: Loaded<Version>, missions: Loaded<Mission>): Entry[] {
  const byId = new Map(missions.items.map((mission) => [mission.id, mission]));
  const shown = new Set<string>();
  const entries: Entry[] = versions.items.map((version) => {
    const mission = (byMission(version) && version.mission !== null && byId.get(version.mission)) || null;
    if (mission) shown.add(mission.id);
    return { kind: "version", at: version.created_at, version, mission };
  });
  for (const mission of missions.items) {
    if (!shown.has(mission.id) && !madeAVersion(mission))
      entries.push({ kind: "mission", at: mission.received_at, mission });
  }
  const horizon = Math.max(
    endOf(versions, (item) => item.created_at),
    endOf(missions, (item) => item.received_at),
  );
  return entries.filter(({ at }) => Date.parse(at) >= horizon).sort((a, b) => Date.parse(b.at) - Date.parse(a.at));
}

/** An edit or a restore stands on a mission's grid, too, but was not caused by it. */
export function byMission(version: Pick<Version, "cause">): boolean {
  return version.cause === "created" || version.cause === "mission";
}

/** The first mission on which the robot set out with a version or a later one: from then on it has what was changed. */
export function onRobotSince(version: number, missions: readonly Mission[]): string | null {
  const knowing = missions.filter(({ left_with }) => left_with !== null && left_with >= version);
  const first = knowing.sort((a, b) => Date.parse(a.received_at) - Date.parse(b.received_at))[0];
  return first?.id ?? null;
}

function madeAVersion({ outcome }: Mission): boolean {
  return outcome === "created" || outcome === "updated" || outcome === "resolved";
}

function endOf<Item>({ items, more }: Loaded<Item>, at: (item: Item) => string): number {
  const last = items.at(-1);
  return more && last ? Date.parse(at(last)) : -Infinity;
}
