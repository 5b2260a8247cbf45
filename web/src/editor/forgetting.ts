/** Drafts are of who made them: what is left of them in the browser is nothing for whoever signs in next. */

export const DRAFTS = "stillroom-draft";

/** Of one robot, else all. */
export function forgetDrafts(robot?: string): void {
  const start = robot === undefined ? `${DRAFTS}:` : `${DRAFTS}:${robot}/`;
  for (const key of Object.keys(localStorage).filter((one) => one.startsWith(start))) localStorage.removeItem(key);
}
