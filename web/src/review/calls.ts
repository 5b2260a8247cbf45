/** What the review page asks of the service. */

import { answered, api, Problem, type Schemas } from "../api/client";
import { type Refused, saveEdit } from "../editor/calls";
import type { MapDocument } from "../map/document";
import type { Line, Operation } from "../map/operations";
import type { Conflict } from "../map/questions";
import { texts } from "../texts";
import type { Answer } from "./answers";

type Decision = Schemas["DecisionRequest"];

const MOST_TRIES = 3;

/** The same again is the same decision: where the answer got lost it may be sent once more. */
export function isLost(error: unknown): boolean {
  return error instanceof Problem && (error.status === 0 || error.status >= 500);
}

export async function decide(conflict: Conflict, { response, proposal }: Answer): Promise<Conflict> {
  return decided(conflict, { response, dividers: [], note: "", ...(proposal !== null && { proposal }) });
}

export async function decideWithLines(conflict: Conflict, lines: readonly Line[]): Promise<Conflict> {
  return decided(conflict, { response: "annotate", dividers: lines.map(pair), note: "" });
}

async function decided({ robot, map, id }: Conflict, body: Decision): Promise<Conflict> {
  const params = { path: { robot, map, conflict: id } };
  return (await answered(
    api.POST("/api/v1/robots/{robot}/maps/{map}/conflicts/{conflict}/decision", { params, body }),
  )) as Conflict;
}

export type Preview =
  | { readonly ok: true; readonly document: MapDocument }
  /** `lines`: the numbers of those that are at fault. */
  | { readonly ok: false; readonly reason: string; readonly lines: readonly number[] };

/** What a decision with these lines would come to. Throws Problem where the service says nothing about them. */
export async function previewLines(
  { robot, map, id }: Conflict,
  lines: readonly Line[],
  signal: AbortSignal,
): Promise<Preview> {
  const call = api.POST("/api/v1/robots/{robot}/maps/{map}/conflicts/{conflict}/decision", {
    params: { path: { robot, map, conflict: id }, query: { dry_run: true } },
    body: { response: "annotate", dividers: lines.map(pair), note: "" },
    signal,
  });
  const { data, error, response } = await call;
  if (data !== undefined) return { ok: true, document: data as unknown as MapDocument };
  const { detail, errors } = { detail: "", errors: [], ...(error as Partial<Refused>) };
  if (response.status !== 422) throw new Problem(response.status, detail || texts.problem.unknown);
  const found = errors.map(({ pointer }) => /^\/dividers\/(\d+)$/.exec(pointer)?.[1]);
  return { ok: false, reason: detail, lines: found.flatMap((n) => (n === undefined ? [] : [Number(n)])) };
}

const round = (metres: number): number => Math.round(metres * 1000) / 1000;
const pair = ([[ax, ay], [bx, by]]: Line): [[number, number], [number, number]] => [
  [round(ax), round(ay)],
  [round(bx), round(by)],
];

/** Edits whatever version is in force: what is asked here fits any. */
export async function editInForce(robot: string, map: string, version: number, operation: Operation): Promise<void> {
  let base = version;
  for (let tries = 0; tries < MOST_TRIES; tries++) {
    const answer = await saveEdit({ robot, map }, base, [operation]);
    if (answer.kind === "done") return;
    if (answer.kind === "unreachable") throw new Problem(0, texts.problem.offline);
    if (answer.kind === "refused") throw new Problem(422, answer.problem.errors[0]?.detail ?? answer.problem.detail);
    base = answer.problem.current;
  }
  throw new Problem(412, texts.problem.unknown);
}
