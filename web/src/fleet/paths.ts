/** Addresses of the fleet's pages. */

import { FLEET_PATH } from "../paths";
import { during, type Filters, searchOf, spanOf } from "./filters";

export const OVERVIEW_PATH = FLEET_PATH;
export const CAUSES_PATH = `${FLEET_PATH}/causes`;

export const withSearch = (path: string, search: string): string => (search ? `${path}?${search}` : path);

export const causesPath = (search: string): string => withSearch(CAUSES_PATH, search);

export const causePath = (cause: string, search: string): string =>
  withSearch(`${CAUSES_PATH}/${encodeURIComponent(cause)}`, search);

/** The rates as a file. */
export function csvPath(filters: Filters, groupBy: string | null): string {
  const { from, to } = spanOf(filters, new Date());
  const search = new URLSearchParams(searchOf(during(filters, from, to)));
  if (groupBy) search.set("group_by", groupBy);
  return `/api/v1/fleet/failure-rates.csv?${search}`;
}

export const missionPath = (robot: string, map: string, mission: string): string =>
  `${FLEET_PATH}/robots/${encodeURIComponent(robot)}/maps/${encodeURIComponent(map)}/missions/${encodeURIComponent(mission)}`;
