/** What the fleet's pages ask for, and how long it stays true. */

import { infiniteQueryOptions, keepPreviousData, queryOptions } from "@tanstack/react-query";
import { answered, api, type Schemas } from "../api/client";
import type { Filters } from "./filters";
import { queryOf } from "./filters";

export type Interval = readonly [number, number];
export type Rates = Schemas["RatesDocument"];
export type RateRow = Schemas["RateRow"];
export type Measure = keyof Schemas["Measures"];
export type Cause = Schemas["CauseRow"];
export type CauseState = Cause["state"];
export type Mission = Schemas["FleetMissionItem"];
export type Inspected = Schemas["InspectedMission"];
export type Figure = Schemas["PlanFigure"];
export type WorstRobot = Schemas["RobotRow"];
export type GroupBy = Exclude<Schemas["RatesDocument"]["group_by"], null>;

export const STATES: readonly CauseState[] = ["new", "ongoing", "regressed", "muted"];
const FLEET = ["fleet"] as const;
const MISSIONS_A_PAGE = 50;
const SOON_STALE = {
  staleTime: 60_000,
  refetchInterval: 60_000,
  placeholderData: keepPreviousData,
} as const;

export const causesKey = [...FLEET, "causes"] as const;

export const ratesQuery = (filters: Filters, groupBy: GroupBy | null) =>
  queryOptions({
    queryKey: [...FLEET, "rates", filters, groupBy],
    ...SOON_STALE,
    queryFn: async ({ signal }) => {
      const query = { ...queryOf(filters, new Date()), ...(groupBy && { group_by: groupBy }) };
      // openapi-fetch types the tuples of its answers as arrays.
      return (await answered(api.GET("/api/v1/fleet/failure-rates", { params: { query }, signal }))) as Rates;
    },
  });

export const knownQuery = queryOptions({
  queryKey: [...FLEET, "filters"],
  staleTime: 600_000,
  queryFn: ({ signal }) => answered(api.GET("/api/v1/fleet/filters", { signal })),
});

export const causesQuery = (filters: Filters, state: CauseState | null) =>
  queryOptions({
    queryKey: [...causesKey, filters, state],
    ...SOON_STALE,
    queryFn: ({ signal }) => {
      const query = { ...queryOf(filters, new Date()), ...(state && { state }) };
      return answered(api.GET("/api/v1/fleet/causes", { params: { query }, signal }));
    },
  });

export const causeQuery = (filters: Filters, cause: string) =>
  queryOptions({
    queryKey: [...causesKey, filters, "one", cause],
    ...SOON_STALE,
    queryFn: ({ signal }) => {
      const params = { path: { cause }, query: queryOf(filters, new Date()) };
      return answered(api.GET("/api/v1/fleet/causes/{cause}", { params, signal }));
    },
  });

/** The missions that failed, by one cause or by any; the newest first. */
export const failuresQuery = (filters: Filters, cause: string | null) =>
  infiniteQueryOptions({
    queryKey: [...FLEET, "missions", filters, cause],
    ...SOON_STALE,
    initialPageParam: null as string | null,
    queryFn: ({ pageParam, signal }) => {
      const query = {
        ...queryOf(filters, new Date()),
        ...(cause && { cause }),
        ...(pageParam && { cursor: pageParam }),
        limit: MISSIONS_A_PAGE,
      };
      return answered(api.GET("/api/v1/fleet/missions", { params: { query }, signal }));
    },
    getNextPageParam: ({ next }) => next,
  });

const STEPS = 1000;

/** The history of a map: its latest missions, the oldest of them first. */
export const stepsQuery = (robot: string, map: string) =>
  queryOptions({
    queryKey: [...FLEET, "steps", robot, map],
    ...SOON_STALE,
    queryFn: async ({ signal }) => {
      const params = { path: { robot, map }, query: { limit: STEPS } };
      const { items } = await answered(api.GET("/api/v1/fleet/robots/{robot}/maps/{map}/missions", { params, signal }));
      return items.toReversed();
    },
  });

export const inspectedQuery = (robot: string, map: string, mission: string) =>
  queryOptions({
    queryKey: [...FLEET, "inspected", robot, map, mission],
    staleTime: 10_000,
    refetchOnWindowFocus: true,
    placeholderData: keepPreviousData,
    queryFn: ({ signal }) =>
      answered(
        api.GET("/api/v1/fleet/robots/{robot}/maps/{map}/missions/{mission}", {
          params: { path: { robot, map, mission } },
          signal,
        }),
      ),
  });

/** Each call is written down for the owner to read: to be made when somebody wants to look, once. */
export async function lookAt(robot: string, map: string, mission: string): Promise<Figure> {
  const params = { path: { robot, map, mission } };
  return (await answered(
    api.GET("/api/v1/fleet/robots/{robot}/maps/{map}/missions/{mission}/figure", { params }),
  )) as Figure;
}

const LATEST = 8;
const LOOK_AGAIN_MS = 10_000;

export const latestQuery = (filters: Filters) =>
  queryOptions({
    queryKey: [...FLEET, "latest", filters],
    ...SOON_STALE,
    refetchInterval: LOOK_AGAIN_MS,
    queryFn: async ({ signal }) => {
      const query = { ...queryOf(filters, new Date()), limit: LATEST };
      return (await answered(api.GET("/api/v1/fleet/missions", { params: { query }, signal }))).items;
    },
  });

export const worstQuery = (filters: Filters, limit: number) =>
  queryOptions({
    queryKey: [...FLEET, "robots", filters, limit],
    ...SOON_STALE,
    queryFn: async ({ signal }) => {
      const query = { ...queryOf(filters, new Date()), sort: "-lower_bound" as const, limit };
      const { items } = await answered(api.GET("/api/v1/fleet/robots", { params: { query }, signal }));
      return items as WorstRobot[];
    },
  });
