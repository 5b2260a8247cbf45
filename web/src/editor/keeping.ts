/** Drafts in the browser's keeping: one for each tab, taken over by another tab when its own is closed. */

import { type Draft, isDirty, parseDraft } from "../map/draft";
import { DRAFTS } from "./forgetting";

export interface Keeper {
  /** What was kept; null: nothing. */
  readonly found: Draft | null;
  keep(draft: Draft): void;
  release(): void;
}

/** The draft that this tab had, else one whose tab is gone, else a new place for one. */
export async function openKeeper(robot: string, map: string): Promise<Keeper> {
  const start = `${DRAFTS}:${robot}/${map}:`;
  const kept = Object.keys(localStorage).filter((key) => key.startsWith(start));
  for (const key of kept) {
    const release = await hold(key);
    if (release) return keeper(key, release);
  }
  const key = start + crypto.getRandomValues(new Uint32Array(2)).join("");
  return keeper(key, (await hold(key)) ?? (() => undefined));
}

function keeper(key: string, release: () => void): Keeper {
  return {
    found: parseDraft(localStorage.getItem(key)),
    keep: (draft) => {
      const worthIt =
        isDirty(draft) || draft.past.length + draft.future.length + draft.saved.length + draft.undone.length > 0;
      try {
        if (worthIt) localStorage.setItem(key, JSON.stringify(draft));
        else localStorage.removeItem(key);
      } catch {
        // No room left: the draft lives on in this page alone.
      }
    },
    release,
  };
}

/** Holds a name for as long as this page lives or until it is released; null where another page holds it. */
async function hold(name: string): Promise<(() => void) | null> {
  // Locks are only to be had where the page came by https or from this machine; without them every draft is free to take.
  if (!("locks" in navigator)) return () => undefined;
  return new Promise((resolve) => {
    void navigator.locks.request(name, { ifAvailable: true }, (lock) => {
      if (!lock) {
        resolve(null);
        return undefined;
      }
      return new Promise<void>((release) => resolve(() => release()));
    });
  });
}
