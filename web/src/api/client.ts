/** Calls of the HTTP API, typed by its OpenAPI document. */

import createClient from "openapi-fetch";
import { texts } from "../texts";
import type { components, paths } from "./schema.gen";

export type Schemas = components["schemas"];

export const api = createClient<paths>({ baseUrl: "/" });

/** An answer that is not a success (RFC 9457), or none at all (`status` 0). */
export class Problem extends Error {
  override readonly name = "Problem";

  constructor(
    readonly status: number,
    detail: string,
  ) {
    super(detail);
  }
}

/** The body of a successful answer. Throws `Problem` for any other. */
export async function answered<T>(call: Promise<{ data?: T; error?: unknown; response: Response }>): Promise<T> {
  const { data, error, response } = await call.catch((cause: unknown) => {
    if (cause instanceof DOMException && cause.name === "AbortError") throw cause;
    throw new Problem(0, texts.problem.offline);
  });
  if (data === undefined) throw new Problem(response.status, detailOf(error));
  return data;
}

function detailOf(error: unknown): string {
  if (typeof error === "object" && error !== null && "detail" in error && typeof error.detail === "string") {
    return error.detail;
  }
  return texts.problem.unknown;
}

export function isSignedOut(error: unknown): boolean {
  return error instanceof Problem && error.status === 401;
}

/** For another's object the API answers 403, for one that never was 404: to a reader both say "not here". */
export function isMissing(error: unknown): boolean {
  return error instanceof Problem && (error.status === 403 || error.status === 404);
}
