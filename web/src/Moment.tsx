import { useEffect, useState } from "react";
import { ago, fullTime } from "./words";

const REFRESH_MS = 30_000;

/** A moment as "5 minutes ago", kept right, with the full time at hand. */
export function Moment({ at }: { readonly at: string }) {
  const [now, setNow] = useState(() => new Date());
  useEffect(() => {
    const timer = setInterval(() => setNow(new Date()), REFRESH_MS);
    return () => clearInterval(timer);
  }, []);
  const moment = new Date(at);
  return (
    <time dateTime={at} title={fullTime(moment)}>
      {ago(moment, now)}
    </time>
  );
}
