/** What the page of one's home says about what is kept of it. */

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const privacyEn = {
  title: "What is kept",
  lead: "Maps belong to your home. Save them, see who looked at them, and delete them whenever you like.",
  save: "Save everything",
  saveHome: "Save everything of the home",
  bringInHome: "Bring a saved home in",
  whole:
    "One file with all maps of all robots and their history, who belongs to the home, and who looked. Brought in again, maps of robots that are yours go to them; others are kept without a robot.",
  saveOf: (robot: string) => `Save everything of ${robot}`,
  bringIn: "Bring maps in",
  bringInOf: (robot: string) => `Bring saved maps into ${robot}`,
  broughtIn: (maps: number, versions: number) =>
    `Brought in: ${count(maps, "map", "maps")}, ${count(versions, "version", "versions")}.`,
  clash: "The robot has a map of this name already.",
  unreadable: "This file can't be used: it is no saved home, or was changed.",
  log: "Who looked",
  logOf: (robot: string) => `Who looked at the maps of ${robot}`,
  nobody: "Nobody has looked or changed anything.",
  did: { look: "looked at", change: "changed", plan: "looked at the floor plan, with your leave:" },
  /** What somebody looked at or changed, by the first word of how the service calls it. */
  things: {
    robot: "the robot",
    map: "the map",
    versions: "the history",
    missions: "missions",
    conflicts: "questions",
    edits: "the rooms",
    rooms: "the rooms",
    segments: "the rooms",
    pin: "the pinned version",
    archive: "everything, to save it",
    home: "everything of the home, to save it",
    token: "the token",
    release: "whose it is",
  } as Readonly<Record<string, string>>,
  times: (n: number) => (n === 1 ? "" : `, ${n} times`),
  from: (network: string) => `from ${network}`,
  erase: "Delete the maps",
  eraseOf: (robot: string) => `Delete the maps of ${robot}`,
  eraseTitle: (robot: string) => `Delete all maps of ${robot}?`,
  eraseText:
    "All maps, all versions, everything that the robot sensed, and all questions and answers are deleted at once and for good. The robot stays yours and begins anew. Save everything first if you may want it back.",
  eraseHome: "Delete everything and the account",
  eraseHomeTitle: "Delete everything of your home, and your account?",
  eraseHomeText:
    "All maps of all your robots, who may see them, your messages and your account are deleted at once and for good. The robots are nobody's afterwards: an operator can give them to somebody else. The fleet's figures keep numbers that lead to nobody.",
  confirm: (name: string) => `Type ${name} to confirm`,
  yes: "Delete for good",
  cancel: "Cancel",
  erased: (maps: number, missions: number) =>
    `Deleted: ${count(maps, "map", "maps")}, ${count(missions, "mission", "missions")}.`,
  keep: "How long what the robots sensed is kept",
  days: (days: number) => (days === 0 ? "As long as the home" : `${days} days`),
  effect: (days: number, newest: number) =>
    days === 0
      ? "What the robots sensed is kept until you delete it."
      : `What the robots sensed is deleted ${days} days after it came. The newest ${newest} versions of each map, versions that are pinned or have a name, and questions that wait keep it. The shapes of rooms stay in the history.`,
  now: (missions: number) =>
    missions === 0
      ? "Nothing is that old now."
      : `Older now: ${count(missions, "mission", "missions")}; what was sensed then is deleted within minutes.`,
  choose: "Keep it so long",
};
