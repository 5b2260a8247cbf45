import classes from "./Fleet.module.css";
import type { Cause } from "./queries";
import { fleetTexts } from "./texts";

const HEIGHT = 34;
const WIDTH = 160;

interface Props {
  readonly trend: Cause["trend"];
  readonly days: readonly string[];
}

/** Missions a day as small bars; days without any are left out of the trend. */
export function Sparkline({ trend, days }: Props) {
  const known = new Map(trend.map(({ day, missions }) => [day, missions]));
  const counts = days.map((one) => known.get(one) ?? 0);
  const most = Math.max(1, ...counts);
  const total = counts.reduce((sum, n) => sum + n, 0);
  const step = WIDTH / counts.length;
  return (
    <svg
      className={classes.spark}
      viewBox={`0 0 ${WIDTH} ${HEIGHT}`}
      preserveAspectRatio="none"
      role="img"
      aria-label={fleetTexts.cause.trendOf(total, counts.at(-1) ?? 0)}
    >
      {counts.map((n, i) => {
        const height = (n / most) * (HEIGHT - 2);
        return n === 0 ? null : (
          <rect key={days[i]} x={i * step} y={HEIGHT - height} width={Math.max(step * 0.78, 0.8)} height={height} />
        );
      })}
    </svg>
  );
}
