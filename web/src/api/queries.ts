/** What pages ask for, and how long it stays true. */

import { infiniteQueryOptions, QueryClient, queryOptions } from "@tanstack/react-query";
import { answered, api, Problem, type Schemas } from "./client";

const FOR_EVER = { staleTime: Number.POSITIVE_INFINITY } as const;
const RETRIES = 3;
const HISTORY_A_PAGE = 100;

export function makeQueryClient(): QueryClient {
  return new QueryClient({
    defaultOptions: {
      queries: {
        // Events say when something is stale; what is at hand is shown until then.
        ...FOR_EVER,
        refetchOnWindowFocus: false,
        retry: (failures, error) => failures < RETRIES && !(error instanceof Problem && isFinal(error.status)),
      },
    },
  });
}

function isFinal(status: number): boolean {
  return status >= 400 && status < 500 && status !== 429;
}

export const robotsQuery = queryOptions({
  queryKey: ["robots"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/robots", { params: { query: { limit: 1000 } }, signal })),
});

/** Who is signed in. */
export const sessionQuery = queryOptions({
  queryKey: ["session"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/session", { signal })),
});

/** Everything of a map that a new event can change has a key that starts like this. */
export const mapKey = (robot: string, map: string) => ["map", robot, map] as const;

/** Questions of all maps have keys that start like this. */
export const QUESTIONS = ["questions"] as const;

type Conflict = Schemas["ConflictDocument"];

/** Questions of all maps that are in a state, the newest first; more than a page of them is a `next`. */
export const questionsQuery = (state: "open" | "resolved_automatically") =>
  queryOptions({
    queryKey: [...QUESTIONS, state],
    queryFn: async ({ signal }) =>
      (await answered(api.GET("/api/v1/conflicts", { params: { query: { state, limit: 200 } }, signal }))) as {
        readonly items: Conflict[];
        readonly next: string | null;
      },
  });

/** Reads anew whatever may have changed, as after events were missed. Versions and grids never do. */
export async function refreshAll(queries: QueryClient): Promise<void> {
  await Promise.all([
    queries.invalidateQueries({ queryKey: robotsQuery.queryKey }),
    queries.invalidateQueries({ queryKey: QUESTIONS }),
    queries.invalidateQueries({ queryKey: ["map"] }),
  ]);
}

// openapi-fetch types the tuples of its answers as arrays; the document's own type knows better.
type MapDocument = Schemas["MapDocument"];

export const headQuery = (robot: string, map: string) =>
  queryOptions({
    queryKey: [...mapKey(robot, map), "head"],
    queryFn: async ({ signal }) => {
      const params = { path: { robot, map } };
      return (await answered(api.GET("/api/v1/robots/{robot}/maps/{map}", { params, signal }))) as MapDocument;
    },
  });

export const versionsQuery = (robot: string, map: string) =>
  infiniteQueryOptions({
    queryKey: [...mapKey(robot, map), "versions"],
    initialPageParam: null as string | null,
    queryFn: ({ pageParam, signal }) =>
      answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/versions", {
          params: { path: { robot, map }, query: { limit: HISTORY_A_PAGE, ...(pageParam && { cursor: pageParam }) } },
          signal,
        }),
      ),
    getNextPageParam: ({ next }) => next,
  });

/** A version never changes, so its key is apart from what events make stale. */
export const versionQuery = (robot: string, map: string, version: number) =>
  queryOptions({
    queryKey: ["version", robot, map, version],
    queryFn: async ({ signal }) => {
      const params = { path: { robot, map, version } };
      return (await answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/versions/{version}", { params, signal }),
      )) as MapDocument;
    },
  });

export const diffQuery = (robot: string, map: string, version: number, other: number) =>
  queryOptions({
    queryKey: ["diff", robot, map, version, other],
    queryFn: ({ signal }) =>
      answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/versions/{version}/diff/{other}", {
          params: { path: { robot, map, version, other } },
          signal,
        }),
      ),
  });

export const missionsQuery = (robot: string, map: string) =>
  infiniteQueryOptions({
    queryKey: [...mapKey(robot, map), "missions"],
    initialPageParam: null as string | null,
    queryFn: ({ pageParam, signal }) =>
      answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/missions", {
          params: { path: { robot, map }, query: { limit: HISTORY_A_PAGE, ...(pageParam && { cursor: pageParam }) } },
          signal,
        }),
      ),
    getNextPageParam: ({ next }) => next,
  });

/** The mission that arrived last, if any. */
export const lastMissionQuery = (robot: string, map: string) =>
  queryOptions({
    queryKey: [...mapKey(robot, map), "last mission"],
    queryFn: async ({ signal }) => {
      const { items } = await answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/missions", {
          params: { path: { robot, map }, query: { limit: 1 } },
          signal,
        }),
      );
      return items[0] ?? null;
    },
  });

/** Missions that wait for a person to say which floor they belong to, the newest first. */
export const parkedQuery = (robot: string, map: string) =>
  queryOptions({
    queryKey: [...mapKey(robot, map), "parked"],
    queryFn: async ({ signal }) => {
      const { items } = await answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/missions", {
          params: { path: { robot, map }, query: { outcome: "parked", limit: 20 } },
          signal,
        }),
      );
      return items.filter(isUndecided);
    },
  });

/** Where the floor that was said did not take the mission, it may belong to another. */
function isUndecided({ decision }: Schemas["MissionDocument"]): boolean {
  return decision === null || decision.outcome === "reverted" || decision.outcome === "superseded";
}

export const missionQuery = (robot: string, map: string, mission: string) =>
  queryOptions({
    queryKey: [...mapKey(robot, map), "mission", mission],
    queryFn: ({ signal }) =>
      answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/missions/{mission}", {
          params: { path: { robot, map, mission } },
          signal,
        }),
      ),
  });

export const conflictQuery = (robot: string, map: string, conflict: string) =>
  queryOptions({
    queryKey: [...mapKey(robot, map), "conflict", conflict],
    queryFn: async ({ signal }) =>
      (await answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/conflicts/{conflict}", {
          params: { path: { robot, map, conflict } },
          signal,
        }),
      )) as Conflict,
  });

/** What the robot saw when a question came up. */
export const sensedQuery = (robot: string, map: string, conflict: string) =>
  queryOptions({
    queryKey: [...mapKey(robot, map), "sensed", conflict],
    queryFn: async ({ signal }) =>
      (await answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/conflicts/{conflict}/sensed", {
          params: { path: { robot, map, conflict } },
          signal,
        }),
      )) as Schemas["SensedDocument"],
  });

/** The map that would be in force if a proposal were accepted. */
export const proposalQuery = (robot: string, map: string, conflict: string, proposal: string) =>
  queryOptions({
    queryKey: [...mapKey(robot, map), "proposal", conflict, proposal],
    queryFn: async ({ signal }) =>
      (await answered(
        api.GET("/api/v1/robots/{robot}/maps/{map}/conflicts/{conflict}/proposals/{proposal}", {
          params: { path: { robot, map, conflict, proposal } },
          signal,
        }),
      )) as MapDocument,
  });

/** The cells under a version, as a picture. Its address names an immutable version. */
export const cellsQuery = (url: string) =>
  queryOptions({
    queryKey: ["cells", url],
    gcTime: 60_000,
    queryFn: async ({ signal }) => {
      const response = await fetch(url, { signal });
      if (!response.ok) throw new Problem(response.status, response.statusText);
      return createImageBitmap(await response.blob(), { premultiplyAlpha: "none", colorSpaceConversion: "none" });
    },
  });
