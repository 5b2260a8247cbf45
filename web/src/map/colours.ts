/** Colours of rooms: one of a few slots, the same for a room id in every version and different between neighbours. */

export type Scheme = "light" | "dark";

/** How many slots there are; the palettes have one colour for each. */
export const SLOTS = 8;

/** Chosen so that any two stay apart (CIE76 of at least 15) for normal, protan, deutan and tritan sight. */
export const ROOM_FILLS: Readonly<Record<Scheme, readonly string[]>> = {
  light: ["#cadaa9", "#dea271", "#bdd2fe", "#f4e696", "#f2c0cc", "#73ad95", "#97a1de", "#a89fba"],
  dark: ["#697249", "#763919", "#6280a2", "#92803c", "#a76e7c", "#225441", "#3d465a", "#624684"],
};

export interface Colourable {
  readonly id: string;
  readonly segmentId: number;
  /** Ids of rooms that it is seen beside. */
  readonly beside: readonly string[];
}

/**
 * A slot for each room id. Every room wants the slot of its segment id; in order of segment id, one whose wish a neighbour
 * already has takes the next free slot. So a new room (the highest segment id) never changes the colours of those before it.
 */
export function colourRooms(rooms: readonly Colourable[]): ReadonlyMap<string, number> {
  const slots = new Map<string, number>();
  const ordered = [...rooms].sort((a, b) => a.segmentId - b.segmentId || (a.id < b.id ? -1 : 1));
  for (const room of ordered) {
    const wish = (((room.segmentId - 1) % SLOTS) + SLOTS) % SLOTS;
    const taken = new Set(room.beside.map((id) => slots.get(id)));
    const free = Array.from({ length: SLOTS }, (_, step) => (wish + step) % SLOTS).find((slot) => !taken.has(slot));
    slots.set(room.id, free ?? wish);
  }
  return slots;
}

export function roomFill(slot: number, scheme: Scheme): string {
  const fills = ROOM_FILLS[scheme];
  return fills[slot % fills.length] ?? "#888888";
}
