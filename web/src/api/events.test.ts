import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { type Connection, follow, type Stream } from "./events";

class FakeStream implements Stream {
  readyState = 0;
  private readonly listeners = new Map<string, (event: { data?: unknown }) => void>();

  addEventListener(type: string, listener: (event: { data?: unknown }) => void): void {
    this.listeners.set(type, listener);
  }

  close(): void {
    this.readyState = 2;
  }

  happens(type: string, data?: unknown): void {
    this.listeners.get(type)?.({ data });
  }

  breaks(state: "retries by itself" | "is given up"): void {
    this.readyState = state === "is given up" ? 2 : 0;
    this.happens("error");
  }
}

function followed() {
  const streams: FakeStream[] = [];
  const events: unknown[] = [];
  const connections: Connection[] = [];
  const onGap = vi.fn();
  const stop = follow({
    open: () => {
      const stream = new FakeStream();
      streams.push(stream);
      return stream;
    },
    kinds: ["version"],
    onEvent: (event) => events.push(event),
    onConnection: (connection) => connections.push(connection),
    onGap,
  });
  const newest = () => streams.at(-1) as FakeStream;
  return { streams, events, connections, onGap, stop, newest };
}

describe("following events", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("passes events on, and reads everything once at the start", () => {
    const { newest, events, connections, onGap } = followed();
    newest().happens("open");
    newest().happens("version", '{"version": 8}');
    newest().happens("version", "{");
    expect(events).toEqual([{ version: 8 }, null]);
    expect(connections).toEqual(["connecting", "live"]);
    expect(onGap).toHaveBeenCalledTimes(1);
  });

  it("leaves a lost connection to the browser, which resumes without a gap", () => {
    const { newest, streams, connections, onGap } = followed();
    newest().happens("open");
    newest().breaks("retries by itself");
    vi.advanceTimersByTime(60_000);
    newest().happens("open");
    expect(streams).toHaveLength(1);
    expect(connections).toEqual(["connecting", "live", "interrupted", "live"]);
    expect(onGap).toHaveBeenCalledTimes(1);
  });

  it("opens a new stream where the browser gave up, ever more patiently, and then reads everything anew", () => {
    const { newest, streams, onGap } = followed();
    newest().happens("open");
    newest().breaks("is given up");
    vi.advanceTimersByTime(999);
    expect(streams).toHaveLength(1);
    vi.advanceTimersByTime(1);
    expect(streams).toHaveLength(2);
    newest().breaks("is given up");
    vi.advanceTimersByTime(1_999);
    expect(streams).toHaveLength(2);
    vi.advanceTimersByTime(1);
    expect(streams).toHaveLength(3);
    newest().happens("open");
    expect(onGap).toHaveBeenCalledTimes(2);
  });

  it("never waits longer than half a minute", () => {
    const { newest, streams } = followed();
    for (let i = 0; i < 10; i++) {
      newest().breaks("is given up");
      vi.advanceTimersByTime(30_000);
    }
    expect(streams).toHaveLength(11);
  });

  it("ends for good when told to", () => {
    const { newest, streams, stop } = followed();
    newest().breaks("is given up");
    stop();
    vi.advanceTimersByTime(60_000);
    expect(streams).toHaveLength(1);
    expect(newest().readyState).toBe(2);
  });
});
