import classes from "./Fleet.module.css";
import { Mark, type Shape } from "./marks";
import type { Interval } from "./queries";

interface OneMark {
  readonly interval: Interval;
  readonly point: number | null;
  readonly colour: string;
  readonly shape: Shape;
}

const ROW = 12;
const WIDTH = 200;

/** Intervals on one axis from 0 to `end`, one below the other; what they say stands beside them in words. */
export function Whiskers({ end, marks }: { readonly end: number; readonly marks: readonly OneMark[] }) {
  const x = (share: number) => 4 + Math.min(share / end, 1) * (WIDTH - 8);
  return (
    <svg
      className={classes.whiskers}
      viewBox={`0 0 ${WIDTH} ${ROW * marks.length}`}
      height={ROW * marks.length}
      preserveAspectRatio="none"
      aria-hidden="true"
    >
      {marks.map(({ interval: [low, high], point, colour, shape }, i) => {
        const y = ROW * (i + 0.5);
        return (
          <g key={colour}>
            <line x1={4} x2={WIDTH - 4} y1={y} y2={y} stroke="var(--edge)" />
            <line x1={x(low)} x2={x(high)} y1={y} y2={y} stroke={`var(${colour})`} strokeWidth="3" opacity="0.55" />
            {point !== null && <Mark shape={shape} x={x(point)} y={y} r={4.5} colour={colour} />}
          </g>
        );
      })}
    </svg>
  );
}
