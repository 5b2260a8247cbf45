/** Every English string that people read, in one place. */

import type { Cause } from "./map/document";
import type { Layer } from "./map/styles";
import type { Passage } from "./map/view";

const square = new Intl.NumberFormat("en", { minimumFractionDigits: 1, maximumFractionDigits: 1 });

export const area = (metres2: number): string => `${square.format(metres2)} m²`;
export const count = (n: number, one: string, many: string): string => `${n} ${n === 1 ? one : many}`;

export const texts = {
  product: "stillroom",
  tagline: "Rooms that stay put while the robot's map moves",
  home: "All maps",
  skip: "Skip to the content",
  notFound: { title: "Nothing here", text: "There is no page at this address.", back: "Back to all maps" },
  retry: "Try again",
  loading: "Loading",
  scheme: {
    auto: "Appearance: as the system. Switch to light.",
    light: "Appearance: light. Switch to dark.",
    dark: "Appearance: dark. Switch to the system's.",
  },
  connection: {
    live: { label: "Live", hint: "New versions appear by themselves." },
    connecting: { label: "Connecting", hint: "Waiting for the service." },
    interrupted: { label: "Reconnecting", hint: "The connection was lost; it is tried again, and nothing is missed." },
  },
  signedOut: {
    title: "Come on in",
    lead: "These maps show the inside of people's homes, so you need to sign in first.",
    start: "Open the one-time link that the service printed when it was started:",
    again: "Is that link used up or out of reach? Make another on the machine that runs the service:",
    once: "Each link lets one browser in, once.",
    check: "I have signed in: look again",
  },
  maps: {
    title: "Homes",
    rooms: (n: number) => (n === 0 ? "no rooms yet" : count(n, "room", "rooms")),
    noMissions: "No missions yet",
    waiting: "No map yet",
    floor: (map: string) => `Floor: ${map}`,
    robot: (id: string) => `Robot ${id}`,
    noMaps: "This robot has not uploaded a mission yet.",
    thumbnail: (name: string) => `Small picture of the map of ${name}`,
    failed: "The list of maps could not be loaded.",
    empty: {
      title: "No robots yet",
      text: "Add a robot on the machine that runs the service, then upload its first mission:",
      after: "The map appears here by itself.",
    },
  },
  map: {
    label: (title: string) => `Map of ${title}`,
    keys: "With the map in focus: arrow keys move it, plus and minus zoom. The rooms are in the list of rooms.",
    zoomIn: "Zoom in",
    zoomOut: "Zoom out",
    fit: "Show the whole map",
    layers: "Layers",
    failed: "This map could not be loaded.",
    missing: "There is no such map, or it belongs to someone else.",
    gridFailed: "The robot's picture of the floor could not be loaded; rooms are shown without it.",
    noVersion: "No mission has made a map yet. As soon as one does, it appears here.",
    noRooms: "No rooms were found on this map yet.",
    tabs: { rooms: "Rooms", history: "History" },
    summary: (rooms: number, total: number) => `${count(rooms, "room", "rooms")}, ${area(total)}`,
    arrived: (version: number, why: string) => `Version ${version} has just arrived: ${why}.`,
  },
  layers: {
    names: "Names",
    rooms: "Rooms",
    walls: "Walls",
    clutter: "Furniture and clutter",
    dividers: "Dividers and doors",
    meta: "Repairs by stillroom",
    restrictions: "No-go zones",
    grid: "What the robot saw",
  } satisfies Record<Layer, string>,
  room: {
    opensTo: "Next to",
    passage: { open: "open", door: "through a door", meta: "at a repaired boundary" } satisfies Record<Passage, string>,
    alone: "No passage to another room is known.",
    lastVisited: (mission: string) => `Last seen in mission ${mission}`,
    pinned: "Pinned: it does not change by itself",
    selected: (name: string, metres2: number) => `${name} selected, ${area(metres2)}`,
  },
  history: {
    step: "Version shown",
    position: (version: number, newest: number) => `Version ${version} of ${newest}`,
    previous: "Previous version",
    next: "Next version",
    old: (version: number) => `You are looking at version ${version}, an older one.`,
    newest: "Back to the newest",
    inForce: "in force",
    earlier: "Show earlier versions",
    failed: "The history could not be loaded.",
    version: (n: number) => `Version ${n}`,
    cause: {
      created: "Map made",
      mission: "Updated by a mission",
      edit: "Edited",
      decision: "A decision was taken",
      restore: "An earlier version was restored",
      import: "Imported",
    } satisfies Record<Cause, string>,
    mission: (id: string) => `mission ${id}`,
    by: {
      robot: "by the robot",
      operator: "by an operator",
      service: "by stillroom",
      person: (who: string) => `by ${who}`,
    },
    scores: "How the rooms came through",
  },
  notCreated: "No map could be made",
  outcome: {
    created: "Map made",
    updated: "Map updated",
    resolved: "Map updated, after a repair",
    needs_review: "Waits for your decision",
    reverted: "Kept the previous map",
    superseded: "Arrived late; map unchanged",
    parked: "Not recognised; set aside",
  } as Record<string, string>,
  status: { queued: "Waiting to be worked on", processing: "Being worked on" } as Record<string, string>,
  score: {
    asBefore: "as before",
    lost: (percent: number) => `${percent} % of it is gone`,
    gained: (percent: number) => `${percent} % of its shape is new`,
    gone: "not found any more",
    notVisited: "not visited, left as it was",
    failed: "did not fit",
  },
  problem: {
    offline: "The service can't be reached.",
    unknown: "Something went wrong.",
  },
};
