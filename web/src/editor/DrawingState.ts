import type { Position } from "../map/document";
import type { Part } from "./EditLayer";

interface Drawing {
  readonly parts: readonly Part[];
  readonly first: Position | null;
}

/** What is being drawn, for the one line that tells of it: it changes with each move of a finger, and nothing else has to. */
export class DrawingState {
  private state: Drawing = { parts: [], first: null };
  private readonly listeners = new Set<() => void>();

  readonly get = (): Drawing => this.state;

  readonly subscribe = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  readonly set = (change: Partial<Drawing>): void => {
    this.state = { ...this.state, ...change };
    for (const listener of this.listeners) listener();
  };
}
