import { useInfiniteQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { missionsQuery, versionsQuery } from "../api/queries";
import { type Entry, type Mission, timeline } from "../map/history";

export interface History {
  /** The newest first. */
  readonly entries: readonly Entry[];
  /** Numbers of the versions that can be stepped through, rising. */
  readonly numbers: readonly number[];
  /** Those that were read so far, the newest first. */
  readonly missions: readonly Mission[];
  readonly isPending: boolean;
  readonly error: Error | null;
  readonly hasMore: boolean;
  readonly isReadingMore: boolean;
  readonly readMore: () => void;
  readonly retry: () => void;
}

export function useHistory(robot: string, map: string): History {
  const versions = useInfiniteQuery(versionsQuery(robot, map));
  const missions = useInfiniteQuery(missionsQuery(robot, map));
  const both = [versions, missions] as const;
  const versionItems = useMemo(() => versions.data?.pages.flatMap(({ items }) => items) ?? [], [versions.data]);
  const missionItems = useMemo(() => missions.data?.pages.flatMap(({ items }) => items) ?? [], [missions.data]);
  const entries = useMemo(
    () =>
      timeline(
        { items: versionItems, more: versions.hasNextPage },
        { items: missionItems, more: missions.hasNextPage },
      ),
    [versionItems, versions.hasNextPage, missionItems, missions.hasNextPage],
  );
  const numbers = useMemo(() => versionItems.map(({ version }) => version).sort((a, b) => a - b), [versionItems]);
  return {
    entries,
    numbers,
    missions: missionItems,
    isPending: both.some(({ isPending }) => isPending),
    error: versions.error ?? missions.error,
    hasMore: both.some(({ hasNextPage }) => hasNextPage),
    isReadingMore: both.some(({ isFetchingNextPage }) => isFetchingNextPage),
    readMore: () => {
      for (const list of both) if (list.hasNextPage) void list.fetchNextPage();
    },
    retry: () => {
      for (const list of both) if (list.isError) void list.refetch();
    },
  };
}
