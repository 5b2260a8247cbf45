/** Addresses of the fleet's pages. */

import { FLEET_PATH } from "../paths";

export const OVERVIEW_PATH = FLEET_PATH;
export const CAUSES_PATH = `${FLEET_PATH}/causes`;

export const withSearch = (path: string, search: string): string => (search ? `${path}?${search}` : path);

export const causesPath = (search: string): string => withSearch(CAUSES_PATH, search);

export const causePath = (cause: string, search: string): string =>
  withSearch(`${CAUSES_PATH}/${encodeURIComponent(cause)}`, search);

export const missionPath = (robot: string, map: string, mission: string): string =>
  `${FLEET_PATH}/robots/${encodeURIComponent(robot)}/maps/${encodeURIComponent(map)}/missions/${encodeURIComponent(mission)}`;
