/** Addresses of pages. */

export const QUESTIONS_PATH = "/questions";

export const SETTINGS_PATH = "/settings";

export const FLEET_PATH = "/fleet";

export const ACCOUNT_PATH = "/account";

export const HOME_PATH = "/home";

export const OPERATOR_PATH = "/operator";

export const FORGOTTEN_PATH = "/forgotten";

export const INVITATION_PATH = "/invitation";

export const NEW_PASSWORD_PATH = "/new-password";

export const questionPath = (robot: string, map: string, conflict: string): string =>
  `${mapPath(robot, map)}/conflicts/${encodeURIComponent(conflict)}`;

export function mapPath(robot: string, map: string, version?: number): string {
  const path = `/robots/${encodeURIComponent(robot)}/maps/${encodeURIComponent(map)}`;
  return version === undefined ? path : `${path}?version=${version}`;
}
