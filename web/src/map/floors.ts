/** Names of floors: what people call them, and what the robot and the API do. */

const LONGEST = 64;

/** The API's name for a floor that a person calls `title`: unaccented letters, digits and dashes, different from all that are `taken`. */
export function floorKey(title: string, taken: readonly string[]): string {
  const plain = title.normalize("NFKD").replace(/\p{M}/gu, "").toLowerCase();
  const key =
    plain
      .replace(/[^a-z0-9]+/g, "-")
      .replace(/^-+|-+$/g, "")
      .slice(0, LONGEST - 4) || "floor";
  const used = new Set(taken);
  let number = 2;
  let free = key;
  while (used.has(free)) free = `${key}-${number++}`;
  return free;
}
