/** Server-sent events: follows one stream for as long as the page is open, through lost connections and restarts of the service. */

export type Connection = "connecting" | "live" | "interrupted";

/** The part of the browser's EventSource that is used here. */
export interface Stream {
  readonly readyState: number;
  close(): void;
  addEventListener(type: string, listener: (event: { readonly data?: unknown }) => void): void;
}

export interface Following {
  readonly open: () => Stream;
  /** Names of the events to listen for. */
  readonly kinds: readonly string[];
  readonly onEvent: (data: unknown) => void;
  readonly onConnection: (connection: Connection) => void;
  /** Called when events may have been missed, so that everything has to be read anew. */
  readonly onGap: () => void;
}

const CLOSED = 2;
const FIRST_WAIT_MS = 1_000;
const LONGEST_WAIT_MS = 30_000;

/** Answers with the function that ends it. */
export function follow({ open, kinds, onEvent, onConnection, onGap }: Following): () => void {
  let stream: Stream;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let wait = FIRST_WAIT_MS;

  const connect = () => {
    stream = open();
    let fresh = true;
    stream.addEventListener("open", () => {
      wait = FIRST_WAIT_MS;
      onConnection("live");
      // A stream that broke resumes by itself after the last event it got; a new one starts at the present.
      if (fresh) onGap();
      fresh = false;
    });
    for (const kind of kinds) stream.addEventListener(kind, ({ data }) => onEvent(parse(data)));
    stream.addEventListener("error", () => {
      onConnection("interrupted");
      if (stream.readyState !== CLOSED) return;
      stream.close();
      timer = setTimeout(connect, wait);
      wait = Math.min(2 * wait, LONGEST_WAIT_MS);
    });
  };

  onConnection("connecting");
  connect();
  return () => {
    clearTimeout(timer);
    stream.close();
  };
}

function parse(data: unknown): unknown {
  try {
    return JSON.parse(String(data));
  } catch {
    return null;
  }
}
