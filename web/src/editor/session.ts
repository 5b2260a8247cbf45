/** One editing of one map: the draft, what the service says of it, and everything that can be done to both. */

import type { MapDocument } from "../map/document";
import type { Draft, State } from "../map/draft";
import * as drafts from "../map/draft";
import { applyFix, indexOfMade, type Operation, type Operations } from "../map/operations";
import { project } from "../map/project";
import { type Answer, type Preview, previewEdit, type Refused, type Stale, saveEdit, undoVersion } from "./calls";
import type { Keeper } from "./keeping";
import { type Keys, keysOf } from "./keys";

const RETRY_MS = 4_000;
const MOST_MERGES = 5;

export interface Offer {
  readonly title: string;
  readonly take: Operations;
}

/** Why something was not done, in place of it. */
export interface Refusal {
  readonly text: string;
  readonly offers: readonly Offer[];
}

export type Standing = "clean" | "unsaved" | "saving" | "waiting";

export interface Editing {
  readonly draft: Draft;
  /** What to show. */
  readonly document: MapDocument;
  readonly made: readonly { readonly pointer: string; readonly feature: string }[];
  readonly problems: Preview["problems"];
  readonly refusal: Refusal | null;
  readonly clash: Stale | null;
  readonly standing: Standing;
  readonly reachable: boolean;
  readonly keys: Keys;
  /** Ids of the features that are there without the draft. */
  readonly known: ReadonlySet<string>;
  /** The version that was saved last from here. */
  readonly lastSaved: number | null;
}

interface Place {
  readonly robot: string;
  readonly map: string;
}

export class EditSession {
  private state: Editing;
  private head: MapDocument;
  private preview: { readonly of: State; readonly answer: Preview } | null = null;
  private readonly listeners = new Set<() => void>();
  private queue: Promise<unknown> = Promise.resolve();
  private timer: ReturnType<typeof setInterval> | undefined;

  constructor(
    private readonly place: Place,
    head: MapDocument,
    private readonly keeper: Keeper,
    private readonly onSaved: (document: MapDocument) => void,
  ) {
    this.head = head;
    const draft = keeper.found ?? drafts.emptyDraft(head.version);
    this.state = {
      draft: drafts.isDirty(draft) ? draft : drafts.rebased(draft, { base: head.version, operations: [] }),
      document: head,
      made: [],
      keys: new Map(head.features.map(({ id }) => [id, id])),
      problems: [],
      refusal: null,
      clash: null,
      standing: "clean",
      reachable: true,
      known: new Set(),
      lastSaved: null,
    };
    this.set({});
    if (drafts.isDirty(this.state.draft)) void this.inTurn(() => this.check());
    if (this.state.draft.waiting) void this.save();
    globalThis.addEventListener?.("online", this.retry);
    this.timer = setInterval(this.retry, RETRY_MS);
  }

  readonly get = (): Editing => this.state;

  readonly subscribe = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  close(): void {
    clearInterval(this.timer);
    globalThis.removeEventListener?.("online", this.retry);
    this.keeper.release();
  }

  /** Another version came into force: by the robot, by somebody else, or by this very page. */
  headArrived(head: MapDocument): void {
    if (head.version <= this.head.version) return;
    this.head = head;
    if (drafts.isDirty(this.state.draft)) {
      void this.inTurn(() => this.check());
    } else {
      this.set({ draft: drafts.rebased(this.state.draft, { base: head.version, operations: [] }) });
    }
  }

  /** Does something, unless the service refuses it: then nothing has changed but the reason that is shown. */
  readonly attempt = (action: (operations: Operations) => Operations): Promise<boolean> =>
    this.inTurn(async () => {
      const before = this.state.draft;
      const after = drafts.done(before, action(before.present.operations));
      if (after === before) return true;
      this.set({ draft: after, refusal: null });
      const refused = await this.check();
      if (!refused) return true;
      this.set({ draft: before, refusal: this.refusal(refused, after.present.operations) });
      return false;
    });

  readonly refuse = (text: string, offers: readonly Offer[] = []): void => this.set({ refusal: { text, offers } });

  readonly dismiss = (): void => this.set({ refusal: null });

  readonly undo = (): Promise<void> =>
    this.inTurn(async () => {
      const step = drafts.undoStep(this.state.draft);
      if (step?.kind === "draft") return this.go(drafts.undone(this.state.draft));
      if (step) await this.takeBack(step.version, drafts.versionUndone);
    });

  readonly redo = (): Promise<void> =>
    this.inTurn(async () => {
      const step = drafts.redoStep(this.state.draft);
      if (step?.kind === "draft") return this.go(drafts.redone(this.state.draft));
      if (step) await this.takeBack(step.version, drafts.versionRedone);
    });

  readonly discard = (): Promise<void> =>
    this.inTurn(async () => {
      this.set({ draft: drafts.discarded(this.state.draft), clash: null, refusal: null });
    });

  readonly save = (): Promise<void> =>
    this.inTurn(async () => {
      this.set({ standing: "saving", refusal: null });
      for (let merges = 0; merges < MOST_MERGES && drafts.isDirty(this.state.draft); merges++) {
        const { base, operations } = this.state.draft.present;
        const answer = await saveEdit(this.place, base, operations);
        if (answer.kind === "unreachable") {
          this.set({ draft: { ...this.state.draft, waiting: true }, reachable: false });
          return;
        }
        if (answer.kind === "done") {
          this.taken(drafts.saved(this.state.draft, answer.value.version), answer.value);
          return;
        }
        if (answer.kind === "refused") {
          const draft = { ...this.state.draft, waiting: false };
          this.set({ draft, refusal: this.refusal(answer.problem, operations), reachable: true });
          return;
        }
        if (!this.merge(answer.problem)) return;
      }
      this.set({ draft: { ...this.state.draft, waiting: false } });
    });

  /** Both changed the same: whose is to count. */
  readonly resolve = (whose: "mine" | "theirs"): Promise<void> =>
    this.inTurn(async () => {
      const { clash } = this.state;
      if (!clash) return;
      const forced =
        whose === "mine" ? clash.merge_conflicts.flatMap(({ operation }) => (operation ? [operation] : [])) : [];
      const present = { base: clash.current, operations: [...clash.merge_operations, ...forced] as Operation[] };
      this.set({ draft: drafts.rebased(this.state.draft, present), clash: null });
      const refused = await this.check();
      if (refused) this.set({ refusal: this.refusal(refused, present.operations) });
    });

  private async go(draft: Draft): Promise<void> {
    this.set({ draft, refusal: null, clash: null });
    await this.check();
  }

  private async takeBack(version: number, after: (draft: Draft, version: number) => Draft): Promise<void> {
    const answer = await undoVersion(this.place, version);
    if (answer.kind === "done") this.taken(after(this.state.draft, answer.value.version), answer.value);
    else if (answer.kind === "unreachable") this.set({ reachable: false });
    else {
      const { saved, undone } = this.state.draft;
      const draft = {
        ...this.state.draft,
        saved: saved.filter((v) => v !== version),
        undone: undone.filter((v) => v !== version),
      };
      this.set({ draft, refusal: { text: answer.problem.detail, offers: [] } });
    }
  }

  /** Asks the service what the draft comes to. Answers with the refusal, if it is one. */
  private async check(): Promise<Refused | null> {
    for (let merges = 0; merges < MOST_MERGES; merges++) {
      const { present } = this.state.draft;
      if (present.operations.length === 0) {
        this.set({ draft: drafts.rebased(this.state.draft, { base: this.head.version, operations: [] }) });
        return null;
      }
      const answer: Answer<Preview> = await previewEdit(this.place, present.base, present.operations);
      if (answer.kind === "unreachable") {
        this.set({ reachable: false });
        return null;
      }
      if (answer.kind === "refused") {
        this.set({ reachable: true });
        return answer.problem;
      }
      if (answer.kind === "done") {
        this.preview = { of: present, answer: answer.value };
        this.set({ reachable: true });
        return null;
      }
      if (!this.merge(answer.problem)) return null;
    }
    return null;
  }

  /** The draft on the newer version; false where it clashes and a person has to say. */
  private merge(stale: Stale): boolean {
    if (!stale.mergeable) {
      this.set({ clash: stale, draft: { ...this.state.draft, waiting: false }, reachable: true });
      return false;
    }
    const present = { base: stale.current, operations: stale.merge_operations as Operation[] };
    this.set({ draft: drafts.rebased(this.state.draft, present), clash: null, reachable: true });
    return true;
  }

  private taken(draft: Draft, document: MapDocument): void {
    if (document.version > this.head.version) this.head = document;
    this.preview = null;
    this.set({ draft, refusal: null, clash: null, reachable: true, lastSaved: document.version });
    this.onSaved(document);
  }

  /** What the service called the things that the same operations made when it was asked last. */
  private names(operations: Operations): ReadonlyMap<number, string> {
    const names = new Map<number, string>();
    if (!this.preview) return names;
    const { of, answer } = this.preview;
    for (const { feature } of answer.made) {
      const index = indexOfMade(answer.made, feature);
      if (index !== null && operations[index]?.op === of.operations[index]?.op) names.set(index, feature);
    }
    return names;
  }

  private refusal(problem: Refused, operations: Operations): Refusal {
    return {
      text: problem.errors[0]?.detail ?? problem.detail,
      offers: (problem.fixes ?? []).map((fix) => ({
        title: fix.title,
        take: applyFix(operations, fix.pointer, fix.operation as Operation),
      })),
    };
  }

  private readonly retry = (): void => {
    if (this.state.draft.waiting && this.state.standing !== "saving") void this.save();
    else if (!this.state.reachable && drafts.isDirty(this.state.draft)) void this.inTurn(() => this.check());
  };

  /** One thing after the other: each starts from what the one before it came to. */
  private inTurn<T>(work: () => Promise<T>): Promise<T> {
    const done = this.queue.then(work);
    this.queue = done.catch(() => undefined).then(() => this.settled());
    return done;
  }

  private settled(): void {
    if (this.state.standing === "saving") this.set({ standing: "clean" });
  }

  private set(change: Partial<Editing>): void {
    const next = { ...this.state, ...change };
    const { draft } = next;
    const previewed =
      this.preview &&
      drafts.same(this.preview.of.operations, draft.present.operations) &&
      this.preview.of.base === draft.present.base;
    const shown = !drafts.isDirty(draft)
      ? { document: this.head, made: [], problems: [] }
      : previewed && this.preview
        ? {
            document: this.preview.answer as MapDocument,
            made: this.preview.answer.made,
            problems: this.preview.answer.problems,
          }
        : { ...project(this.head, draft.present.operations, this.names(draft.present.operations)), problems: [] };
    const standing =
      change.standing === "saving" || (next.standing === "saving" && change.standing === undefined)
        ? "saving"
        : draft.waiting
          ? "waiting"
          : drafts.isDirty(draft)
            ? "unsaved"
            : "clean";
    const known = new Set(this.head.features.map(({ id }) => id));
    this.state = { ...next, ...shown, keys: keysOf(shown, this.state), standing, known };
    this.keeper.keep(draft);
    for (const listener of this.listeners) listener();
  }
}
