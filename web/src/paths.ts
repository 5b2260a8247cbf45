/** Addresses of pages. */

export function mapPath(robot: string, map: string, version?: number): string {
  const path = `/robots/${encodeURIComponent(robot)}/maps/${encodeURIComponent(map)}`;
  return version === undefined ? path : `${path}?version=${version}`;
}
