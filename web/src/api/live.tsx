/** The stream of events, as React sees it: marks what an event made stale, and tells how the connection is. */

import { useQueryClient } from "@tanstack/react-query";
import { createContext, type ReactNode, useContext, useEffect, useState } from "react";
import type { Schemas } from "./client";
import { type Connection, follow } from "./events";
import { mapKey, QUESTIONS, refreshAll, robotsQuery } from "./queries";

const EVENTS_URL = "/api/v1/events";
const KINDS: readonly Schemas["Event"]["kind"][] = ["mission", "version", "conflict", "decision", "settings"];
const POLL_WHILE_INTERRUPTED_MS = 30_000;

const ConnectionContext = createContext<Connection>("connecting");

export const useConnection = (): Connection => useContext(ConnectionContext);

export function Live({ children }: { readonly children: ReactNode }) {
  const queries = useQueryClient();
  const [connection, setConnection] = useState<Connection>("connecting");

  useEffect(
    () =>
      follow({
        open: () => new EventSource(EVENTS_URL),
        kinds: KINDS,
        onConnection: setConnection,
        onGap: () => void refreshAll(queries),
        onEvent: (event) => {
          void queries.invalidateQueries({ queryKey: robotsQuery.queryKey });
          void queries.invalidateQueries({ queryKey: QUESTIONS });
          const of = mapOf(event);
          if (of) void queries.invalidateQueries({ queryKey: mapKey(of.robot, of.map) });
        },
      }),
    [queries],
  );

  useEffect(() => {
    if (connection !== "interrupted") return;
    const timer = setInterval(() => void refreshAll(queries), POLL_WHILE_INTERRUPTED_MS);
    return () => clearInterval(timer);
  }, [connection, queries]);

  return <ConnectionContext value={connection}>{children}</ConnectionContext>;
}

function mapOf(event: unknown): { robot: string; map: string } | null {
  if (typeof event !== "object" || event === null || !("robot" in event) || !("map" in event)) return null;
  const { robot, map } = event;
  return typeof robot === "string" && typeof map === "string" ? { robot, map } : null;
}
