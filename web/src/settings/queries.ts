/** What a person is told, and by which way. */

import { queryOptions } from "@tanstack/react-query";
import { answered, api, Problem, type Schemas } from "../api/client";
import { texts } from "../texts";

export type Settings = Schemas["NotificationSettings"];
export type Kind = Settings["email"]["kinds"][number];
export type Webhook = Schemas["WebhookDocument"];
export type EventType = Webhook["types"][number];

export const KINDS: readonly Kind[] = ["conflict", "parked", "room"];
export const TYPES: readonly EventType[] = [
  "conflict.opened",
  "conflict.resolved",
  "conflict.closed",
  "mission.parked",
  "map.updated",
  "room.discovered",
];
const DELIVERIES_SHOWN = 10;
const LOOK_AGAIN_MS = 3_000;

export const settingsQuery = queryOptions({
  queryKey: ["notifications"],
  // The link in an e-mail is opened in another tab.
  refetchOnWindowFocus: "always",
  queryFn: ({ signal }) => answered(api.GET("/api/v1/notifications", { signal })),
});

export const webhooksQuery = queryOptions({
  queryKey: ["webhooks"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/webhooks", { signal })),
});

export const deliveriesQuery = (webhook: string) =>
  queryOptions({
    queryKey: ["webhooks", webhook, "deliveries"],
    queryFn: ({ signal }) =>
      answered(
        api.GET("/api/v1/webhooks/{webhook}/deliveries", {
          params: { path: { webhook }, query: { limit: DELIVERIES_SHOWN } },
          signal,
        }),
      ),
    refetchInterval: ({ state }) => (state.data?.items.some((one) => one.state === "waiting") ? LOOK_AGAIN_MS : false),
  });

/** For answers without a body. Throws `Problem` for any but a success. */
export async function done(call: Promise<{ error?: unknown; response: Response }>): Promise<null> {
  const { error, response } = await call.catch(() => {
    throw new Problem(0, texts.problem.offline);
  });
  if (response.ok) return null;
  const { detail } = { detail: texts.problem.unknown, ...(error as { detail?: string }) };
  throw new Problem(response.status, detail);
}
