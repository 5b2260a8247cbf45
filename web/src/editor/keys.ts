/** What a page knows features by while their ids change: what a draft makes is named anew when the service answers. */

import type { MapDocument, MapFeature, RoomFeature } from "../map/document";
import { contains, labelSpot } from "../map/geometry";

/** By id, of each feature that is shown. A key is one thing's alone, and lasts as long as the thing. */
export type Keys = ReadonlyMap<string, string>;

export interface Shown {
  readonly document: MapDocument;
  readonly made: readonly { readonly pointer: string; readonly feature: string }[];
}

export function keysOf(after: Shown, before: Shown & { readonly keys: Keys }): Keys {
  const ids = new Set(after.document.features.map(({ id }) => id));
  const lost = new Set(before.document.features.filter(({ id }) => !ids.has(id)));
  const given = new Set(before.keys.values());
  const keys = new Map<string, string>();
  for (const feature of after.document.features) {
    const was = before.keys.has(feature.id) ? feature : find(lost, (one) => isSame(one, before, feature, after));
    const key = (was && before.keys.get(was.id)) ?? unused(feature.id, given);
    if (was) lost.delete(was);
    given.add(key);
    keys.set(feature.id, key);
  }
  return keys;
}

/** The id that the thing has now; null: it is gone. */
export const idOf = (key: string, keys: Keys): string | null => find(keys, ([, one]) => one === key)?.[0] ?? null;

/** What the same operation made is the same, and so is a room that lies where the other one did. */
function isSame(one: MapFeature, before: Shown, other: MapFeature, after: Shown): boolean {
  if (one.properties.semantic !== other.properties.semantic) return false;
  if (one.properties.semantic === "room") {
    const { at } = labelSpot((one as RoomFeature).geometry.coordinates);
    return contains((other as RoomFeature).geometry.coordinates, at);
  }
  const pointer = pointerOf(one, before);
  return pointer !== undefined && pointer === pointerOf(other, after);
}

const pointerOf = ({ id }: MapFeature, { made }: Shown) => made.find(({ feature }) => feature === id)?.pointer;

function unused(id: string, given: ReadonlySet<string>): string {
  let key = id;
  while (given.has(key)) key += "'";
  return key;
}

function find<T>(among: Iterable<T>, isMeant: (one: T) => boolean): T | undefined {
  for (const one of among) if (isMeant(one)) return one;
  return undefined;
}
