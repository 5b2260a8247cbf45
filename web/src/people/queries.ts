/** People: accounts, homes and who may what. */

import { queryOptions } from "@tanstack/react-query";
import { answered, api, Problem, type Schemas } from "../api/client";
import { language, texts } from "../texts";
import { peopleTexts } from "./texts";

export type Session = Schemas["SessionDocument"];
export type Scope = Schemas["TokenDocument"]["scopes"][number];
export type Role = Schemas["MemberDocument"]["role"];
export type Duty = NonNullable<Schemas["AccountDocument"]["duty"]>;
export type Account = Schemas["AccountDocument"];
export type Robot = Schemas["RobotDocument"];

const MOST = 1000;

export const waysQuery = queryOptions({
  queryKey: ["sign-in"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/sign-in", { signal })),
});

export const accountQuery = queryOptions({
  queryKey: ["account"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/account", { signal })),
});

export const sessionsQuery = queryOptions({
  queryKey: ["account", "sessions"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/account/sessions", { signal })),
});

export const tokensQuery = queryOptions({
  queryKey: ["account", "tokens"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/account/tokens", { signal })),
});

export const householdQuery = queryOptions({
  queryKey: ["household"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/household", { signal })),
});

export const registryQuery = queryOptions({
  queryKey: ["registry"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/registry", { params: { query: { limit: MOST } }, signal })),
});

export const accountsQuery = queryOptions({
  queryKey: ["accounts"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/accounts", { params: { query: { limit: MOST } }, signal })),
});

export const invitationsQuery = queryOptions({
  queryKey: ["accounts", "invitations"],
  queryFn: ({ signal }) => answered(api.GET("/api/v1/accounts/invitations", { signal })),
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

/** What went wrong, in the reader's language where that is known. `known`: by status. */
export function said(error: Error, known: Readonly<Record<number, string>> = {}): string {
  if (!(error instanceof Problem)) return texts.problem.unknown;
  const { problems, otherwise } = peopleTexts;
  const reason = language === "en" ? undefined : otherwise[error.status];
  return known[error.status] ?? problems[error.status] ?? reason ?? error.message;
}
