import { useQuery } from "@tanstack/react-query";
import classes from "./Fleet.module.css";
import { axisEnd, compared, whole } from "./figures";
import { dayOf, during, type Filters, shifted } from "./filters";
import { Panel } from "./Panel";
import { type Measure, type RateRow, ratesQuery } from "./queries";
import { Share } from "./RatesPanel";
import own from "./TodayPanel.module.css";
import { fleetTexts } from "./texts";
import { Whiskers } from "./Whiskers";

const SHOWN: readonly Measure[] = ["transfer", "meta_occupancy", "meta_dividers", "needs_review", "reverted"];

/** Today against the seven days before, whatever the span. */
export function TodayPanel({ filters }: { readonly filters: Filters }) {
  const today = dayOf(new Date());
  const now = useQuery(ratesQuery(during(filters, today, today), null)).data?.total;
  const before = useQuery(ratesQuery(during(filters, shifted(today, -7), shifted(today, -1)), null)).data?.total;
  if (!now || !before) return null;
  const { today: texts } = fleetTexts;
  const nothing = now.missions === 0 || before.missions === 0;
  return (
    <Panel wide title={texts.title} lead={texts.lead}>
      <p className={classes.counts}>
        {texts.today}: {fleetTexts.of(whole(now.missions), fleetTexts.robots(now.robots))} · {texts.week}:{" "}
        {fleetTexts.of(whole(before.missions), fleetTexts.robots(before.robots))}
      </p>
      <ul className={own.tiles}>
        {SHOWN.map((of) => {
          const verdict = nothing ? "same" : compared(now.ci95[of], before.ci95[of]);
          const end = axisEnd([now.ci95[of][1], before.ci95[of][1]].filter((_, i) => [now, before][i]?.missions));
          return (
            <li key={of} data-verdict={verdict}>
              <h3>{fleetTexts.measure[of]}</h3>
              <p className={own.verdict}>{nothing ? texts.nothing : `${SIGNS[verdict]} ${texts[verdict]}`}</p>
              <dl>
                <Line name={texts.today} row={now} of={of} end={end} strong />
                <Line name={texts.week} row={before} of={of} end={end} />
              </dl>
            </li>
          );
        })}
      </ul>
    </Panel>
  );
}

const SIGNS = { higher: "▲", lower: "▼", same: "=" } as const;

interface LineProps {
  readonly name: string;
  readonly row: RateRow;
  readonly of: Measure;
  readonly end: number;
  readonly strong?: boolean;
}

function Line({ name, row, of, end, strong = false }: LineProps) {
  const colour = strong ? "--ink" : "--ink-soft";
  return (
    <>
      <dt>{name}</dt>
      <dd>
        {row.missions === 0 ? fleetTexts.today.nothing : <Share row={row} of={of} />}
        {row.missions > 0 && (
          <Whiskers
            end={end}
            marks={[{ interval: row.ci95[of], point: row.sufficient ? row.rates[of] : null, colour, shape: "circle" }]}
          />
        )}
      </dd>
    </>
  );
}
