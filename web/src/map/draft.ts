/** What a person has changed and not saved: states of operations with the ones before and after them, so that undo has no end. */

import type { Operations } from "./operations";

/** Operations that were asked of version `base`. */
export interface State {
  readonly base: number;
  readonly operations: Operations;
}

export interface Draft {
  readonly past: readonly State[];
  readonly present: State;
  readonly future: readonly State[];
  /** Versions that were saved from here, the newest last: undo goes on through them. */
  readonly saved: readonly number[];
  /** Versions that took saved ones back, the newest last: redo takes these back in turn. */
  readonly undone: readonly number[];
  /** Saving was asked for and waits for the network. */
  readonly waiting: boolean;
}

export function emptyDraft(base: number): Draft {
  return { past: [], present: { base, operations: [] }, future: [], saved: [], undone: [], waiting: false };
}

export const isDirty = ({ present }: Draft): boolean => present.operations.length > 0;

/** The next state. What was undone before can't be redone any more. */
export function done(draft: Draft, operations: Operations): Draft {
  if (same(operations, draft.present.operations)) return draft;
  const present = { base: draft.present.base, operations };
  return { ...draft, past: [...draft.past, draft.present], present, future: [], undone: [] };
}

export type Step = { readonly kind: "draft" } | { readonly kind: "version"; readonly version: number } | null;

/** What undo would take back: a state of the draft, else the newest saved version. */
export function undoStep({ past, saved }: Draft): Step {
  if (past.length > 0) return { kind: "draft" };
  const version = saved.at(-1);
  return version === undefined ? null : { kind: "version", version };
}

export function redoStep({ future, undone }: Draft): Step {
  if (future.length > 0) return { kind: "draft" };
  const version = undone.at(-1);
  return version === undefined ? null : { kind: "version", version };
}

export function undone(draft: Draft): Draft {
  const present = draft.past.at(-1);
  if (!present) return draft;
  return { ...draft, past: draft.past.slice(0, -1), present, future: [draft.present, ...draft.future] };
}

export function redone(draft: Draft): Draft {
  const [present, ...future] = draft.future;
  if (!present) return draft;
  return { ...draft, past: [...draft.past, draft.present], present, future };
}

/** The present became version `version`. */
export function saved(draft: Draft, version: number): Draft {
  return { ...emptyDraft(version), saved: [...draft.saved, version] };
}

/** The newest saved version was taken back by `version`. */
export function versionUndone(draft: Draft, version: number): Draft {
  return { ...emptyDraft(version), saved: draft.saved.slice(0, -1), undone: [...draft.undone, version] };
}

/** What took a version back was itself taken back by `version`. */
export function versionRedone(draft: Draft, version: number): Draft {
  return { ...emptyDraft(version), saved: [...draft.saved, version], undone: draft.undone.slice(0, -1) };
}

/** The present, as it is to be asked of another version. */
export function rebased(draft: Draft, present: State): Draft {
  return { ...draft, present };
}

export function discarded(draft: Draft): Draft {
  if (!isDirty(draft)) return { ...draft, waiting: false };
  return { ...done(draft, []), waiting: false };
}

export function same(a: Operations, b: Operations): boolean {
  return a === b || JSON.stringify(a) === JSON.stringify(b);
}

/** A draft as it was kept in the browser; null for anything else. */
export function parseDraft(text: string | null): Draft | null {
  if (text === null) return null;
  try {
    const found: unknown = JSON.parse(text);
    return isDraft(found) ? found : null;
  } catch {
    return null;
  }
}

function isDraft(value: unknown): value is Draft {
  if (typeof value !== "object" || value === null) return false;
  const draft = value as Partial<Draft>;
  const states = [draft.present, ...(Array.isArray(draft.past) ? draft.past : [null])];
  const isState = (state: unknown) =>
    typeof state === "object" &&
    state !== null &&
    Number.isInteger((state as State).base) &&
    Array.isArray((state as State).operations);
  return states.every(isState) && [draft.future, draft.saved, draft.undone].every(Array.isArray);
}
