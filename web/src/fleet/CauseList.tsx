import { Link } from "wouter";
import { Moment } from "../Moment";
import own from "./CauseList.module.css";
import classes from "./Fleet.module.css";
import { percent } from "./figures";
import { causePath } from "./paths";
import type { Cause, CauseState } from "./queries";
import { Sparkline } from "./Sparkline";
import { fleetTexts } from "./texts";

const SIGNS: Readonly<Record<CauseState, string>> = { new: "✳", ongoing: "…", regressed: "↺", muted: "∅" };

export function StateBadge({ state }: { readonly state: CauseState }) {
  return (
    <span className={classes.badge} data-state={state}>
      <span aria-hidden="true">{SIGNS[state]}</span> {fleetTexts.cause.state[state]}
    </span>
  );
}

/** As engineers name it: the criterion and its cause. */
export const nameOf = ({ kind, cause }: Pick<Cause, "kind" | "cause">): string => `${kind} / ${cause}`;

interface Props {
  readonly causes: readonly Cause[];
  readonly days: readonly string[];
  readonly search: string;
}

/** What missions failed by, the most frequent first. */
export function CauseList({ causes, days, search }: Props) {
  const { cause: texts } = fleetTexts;
  return (
    <ol className={own.causes}>
      {causes.map((one) => (
        <li key={one.id}>
          <div className={own.causeName}>
            <Link href={causePath(one.id, search)}>{nameOf(one)}</Link>
            <StateBadge state={one.state} />
            <p>
              {texts.stage[one.stage] ?? one.stage} · {texts.algorithm} {said(one.algorithm)}
            </p>
          </div>
          <div className={own.causeShare}>
            <span className={classes.track} aria-hidden="true">
              <span className={classes.bar} style={{ width: `${100 * one.share}%` }} />
            </span>
            <p>
              <strong>{texts.share(percent(one.share))}</strong> · {fleetTexts.n(one.missions)} ·{" "}
              {fleetTexts.robots(one.robots)}
            </p>
          </div>
          <Sparkline trend={one.trend} days={days} />
          <p className={own.seen}>
            {texts.first} <Moment at={one.first_seen} />
            <br />
            {texts.last} <Moment at={one.last_seen} />
          </p>
        </li>
      ))}
    </ol>
  );
}

const said = (algorithm: string): string => algorithm || fleetTexts.unknown;
