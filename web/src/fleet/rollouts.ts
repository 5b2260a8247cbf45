/** What the pages of rollouts, replays and operations ask for. */

import { queryOptions } from "@tanstack/react-query";
import { answered, api, type Schemas } from "../api/client";

export type Rollout = Schemas["RolloutDocument"];
export type Report = Schemas["RolloutReport"];
export type Gate = Schemas["GateReport"];
export type Paired = Schemas["PairedTable"];
export type Alert = Schemas["AlertDocument"];
export type NewAlert = Schemas["NewAlert"];
export type Measure = Gate["measure"];
export const MEASURES: readonly Measure[] = [
  "transfer",
  "meta_occupancy",
  "meta_dividers",
  "reverted",
  "needs_review",
  "parked",
  "escapes",
];
const KEY = ["fleet", "rollouts"] as const;
const SOON = { staleTime: 5_000, refetchInterval: 15_000 } as const;

export const rolloutsKey = KEY;
export const alertsKey = ["fleet", "alerts"] as const;
export const unprocessedKey = ["fleet", "unprocessed"] as const;

export const rolloutsQuery = queryOptions({
  queryKey: KEY,
  ...SOON,
  queryFn: async ({ signal }) => (await answered(api.GET("/api/v1/fleet/rollouts", { signal }))).items,
});

export const rolloutQuery = (name: string) =>
  queryOptions({
    queryKey: [...KEY, name],
    ...SOON,
    queryFn: async ({ signal }) => {
      const params = { path: { rollout: name } };
      // openapi-fetch types the tuples of its answers as arrays.
      return (await answered(api.GET("/api/v1/fleet/rollouts/{rollout}", { params, signal }))) as Report;
    },
  });

export const changedMapsQuery = (name: string) =>
  queryOptions({
    queryKey: [...KEY, name, "maps"],
    ...SOON,
    queryFn: async ({ signal }) =>
      (
        await answered(
          api.GET("/api/v1/fleet/rollouts/{rollout}/maps", { params: { path: { rollout: name } }, signal }),
        )
      ).items,
  });

export const replaysQuery = queryOptions({
  queryKey: ["fleet", "replays"],
  ...SOON,
  queryFn: async ({ signal }) => (await answered(api.GET("/api/v1/fleet/replays", { signal }))).items,
});

export const replayQuery = (name: string) =>
  queryOptions({
    queryKey: ["fleet", "replays", name],
    ...SOON,
    queryFn: ({ signal }) =>
      answered(api.GET("/api/v1/fleet/replays/{replay}", { params: { path: { replay: name } }, signal })),
  });

export type Cell = "only_old" | "only_new";

export const replayedQuery = (name: string, measure: Paired["measure"], cell: Cell) =>
  queryOptions({
    queryKey: ["fleet", "replays", name, measure, cell],
    staleTime: 15_000,
    queryFn: async ({ signal }) => {
      const params = { path: { replay: name }, query: { measure, cell, limit: 100 } };
      return (await answered(api.GET("/api/v1/fleet/replays/{replay}/missions", { params, signal }))).items;
    },
  });

export const alertsQuery = queryOptions({
  queryKey: alertsKey,
  ...SOON,
  queryFn: async ({ signal }) => (await answered(api.GET("/api/v1/fleet/alerts", { signal }))).items as Alert[],
});

export const unprocessedQuery = queryOptions({
  queryKey: unprocessedKey,
  ...SOON,
  queryFn: async ({ signal }) => {
    const params = { query: { limit: 100 } };
    return (await answered(api.GET("/api/v1/fleet/unprocessed", { params, signal }))).items;
  },
});
