/** What the editor asks of the service, and each way in which it may answer. */

import { api, type Schemas } from "../api/client";
import type { MapDocument } from "../map/document";
import type { Operations } from "../map/operations";

export type Preview = Schemas["EditPreview"];
export type Refused = Schemas["RefusedEdit"];
export type Stale = Schemas["StaleEdit"];

export type Answer<T> =
  | { readonly kind: "done"; readonly value: T }
  | { readonly kind: "stale"; readonly problem: Stale }
  | { readonly kind: "refused"; readonly problem: Refused }
  | { readonly kind: "unreachable" };

export interface Place {
  readonly robot: string;
  readonly map: string;
}

type Call<T> = Promise<{ data?: T; error?: unknown; response: Response }>;

async function answer<T>(call: Call<unknown>): Promise<Answer<T>> {
  const { data, error, response } = await call.catch(() => ({ data: undefined, error: undefined, response: null }));
  // A proxy's 502 or the service's own 503 is a network that will be back, too.
  if (!response || response.status >= 500) return { kind: "unreachable" };
  if (data !== undefined) return { kind: "done", value: data as T };
  if (response.status === 412) return { kind: "stale", problem: error as Stale };
  return { kind: "refused", problem: { errors: [], fixes: [], detail: "", ...(error as Partial<Refused>) } as Refused };
}

const edit = (place: Place, base: number, operations: Operations, dryRun: boolean) =>
  api.POST("/api/v1/robots/{robot}/maps/{map}/edits", {
    params: { path: { ...place }, query: { dry_run: dryRun }, header: { "if-match": `"v${base}"` } },
    body: { operations: [...operations] },
  });

export const previewEdit = (place: Place, base: number, operations: Operations): Promise<Answer<Preview>> =>
  answer<Preview>(edit(place, base, operations, true));

export const saveEdit = (place: Place, base: number, operations: Operations): Promise<Answer<MapDocument>> =>
  answer<MapDocument>(edit(place, base, operations, false));

export const undoVersion = (place: Place, version: number): Promise<Answer<MapDocument>> =>
  answer<MapDocument>(
    api.POST("/api/v1/robots/{robot}/maps/{map}/versions/{version}/undo", { params: { path: { ...place, version } } }),
  );

/** Operations that part the rooms more finely the higher the sensitivity is. */
export const askSuggested = (place: Place, sensitivity: number, signal: AbortSignal) =>
  api.GET("/api/v1/robots/{robot}/maps/{map}/edits/suggested", {
    params: { path: { ...place }, query: { sensitivity } },
    signal,
  });
