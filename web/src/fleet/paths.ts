/** Addresses of the fleet's pages. */

import { FLEET_PATH } from "../paths";
import { during, type Filters, searchOf, spanOf } from "./filters";

export const OVERVIEW_PATH = FLEET_PATH;
export const CAUSES_PATH = `${FLEET_PATH}/causes`;

export const ROLLOUTS_PATH = `${FLEET_PATH}/rollouts`;
export const REPLAYS_PATH = `${FLEET_PATH}/replays`;
export const OPERATIONS_PATH = `${FLEET_PATH}/operations`;

export const rolloutPath = (name: string): string => `${ROLLOUTS_PATH}/${encodeURIComponent(name)}`;

export const replayPath = (name: string): string => `${REPLAYS_PATH}/${encodeURIComponent(name)}`;

export const withSearch = (path: string, search: string): string => (search ? `${path}?${search}` : path);

export const causesPath = (search: string): string => withSearch(CAUSES_PATH, search);

export const causePath = (cause: string, search: string): string =>
  withSearch(`${CAUSES_PATH}/${encodeURIComponent(cause)}`, search);

/** The rates as a file. */
export function ratesPath(filters: Filters, groupBy: string | null, as: "csv" | "parquet"): string {
  const { from, to } = spanOf(filters, new Date());
  const search = new URLSearchParams(searchOf(during(filters, from, to)));
  if (groupBy) search.set("group_by", groupBy);
  return `/api/v1/fleet/failure-rates.${as}?${search}`;
}

export const missionPath = (robot: string, map: string, mission: string): string =>
  `${FLEET_PATH}/robots/${encodeURIComponent(robot)}/maps/${encodeURIComponent(map)}/missions/${encodeURIComponent(mission)}`;
