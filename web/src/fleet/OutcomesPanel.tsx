import { useMemo, useState } from "react";
import uPlot from "uplot";
import { Link } from "wouter";
import classes from "./Fleet.module.css";
import { day, percent, shortDay, whole } from "./figures";
import type { Filters } from "./filters";
import { FILLS, FillSample, OUTCOMES, type Outcome, tile } from "./marks";
import { Panel, Table, TableSwitch } from "./Panel";
import type { RateRow, Rates } from "./queries";
import { useDays } from "./RatesPanel";
import { type Drawing, type Ink, TimeChart } from "./TimeChart";
import { fleetTexts } from "./texts";

interface Props {
  readonly rates: Rates;
  readonly filters: Filters;
}

/** What missions came to, as bars. */
export function OutcomesPanel({ rates, filters }: Props) {
  const [asTable, setAsTable] = useState(false);
  const [withTaken, setWithTaken] = useState(false);
  const [pointed, setPointed] = useState<number | null>(null);
  const { unit, days, rows, failuresOf, pick, narrow } = useDays({ rates, filters });
  const drawn = useMemo(() => OUTCOMES.filter((one) => withTaken || one !== "taken"), [withTaken]);
  const values = useMemo(() => stacked(rows, drawn), [rows, drawn]);
  const draw = useMemo(() => (ink: Ink) => drawing(ink, drawn, values), [drawn, values]);
  const shown = pointed ?? rows.findLastIndex((row) => row !== null);
  const row = rows[shown];
  const label = fleetTexts.outcomes.label(day(rates.first), day(rates.last));
  const when = unit === "week" ? fleetTexts.chart.week : fleetTexts.chart.day;
  return (
    <Panel
      wide
      title={fleetTexts.outcomes.title}
      tools={
        <>
          {!asTable && (
            <label className={classes.check}>
              <input type="checkbox" checked={withTaken} onChange={() => setWithTaken(!withTaken)} />
              {fleetTexts.outcomes.withTaken}
            </label>
          )}
          <TableSwitch on={asTable} onChange={setAsTable} />
        </>
      }
    >
      {asTable ? (
        <Table label={label}>
          <thead>
            <tr>
              <th scope="col">{when}</th>
              {OUTCOMES.map((name) => (
                <th key={name} scope="col">
                  {nameOf(name)}
                </th>
              ))}
              <th scope="col">{fleetTexts.chart.nHead}</th>
              <th scope="col">{fleetTexts.chart.robotsHead}</th>
            </tr>
          </thead>
          <tbody>
            {rows.map((one, i) =>
              one === null ? null : (
                <tr key={one.key}>
                  <th scope="row">
                    <Link href={failuresOf(i)}>{day(one.key)}</Link>
                  </th>
                  {OUTCOMES.map((name) => (
                    <td key={name}>{whole(count(one, name))}</td>
                  ))}
                  <td>{whole(one.missions)}</td>
                  <td>{whole(one.robots)}</td>
                </tr>
              ),
            )}
          </tbody>
        </Table>
      ) : (
        <>
          <TimeChart
            low
            label={label}
            days={days}
            values={values}
            draw={draw}
            onPoint={setPointed}
            onPick={pick}
            onSpan={narrow}
          />
          {row && (
            <div className={classes.readout}>
              <p>
                <strong>{unit === "week" ? `${when} ${shortDay(row.key)}` : day(row.key)}</strong>{" "}
                {fleetTexts.of(whole(row.missions), fleetTexts.robots(row.robots))}
              </p>
              <ul className={classes.legend}>
                {OUTCOMES.map((name) => (
                  <li key={name} title={name === "taken" ? fleetTexts.outcomes.takenHint : undefined}>
                    <FillSample outcome={name} /> {nameOf(name)}: <strong>{whole(count(row, name))}</strong>
                    {row.sufficient && <span> ({percent(count(row, name) / (row.missions + row.parked))})</span>}
                  </li>
                ))}
              </ul>
            </div>
          )}
        </>
      )}
    </Panel>
  );
}

function nameOf(outcome: Outcome): string {
  return outcome === "taken" ? fleetTexts.outcomes.taken : fleetTexts.measure[outcome];
}

function count(row: RateRow, outcome: Outcome): number {
  return outcome === "taken" ? row.missions - row.reverted - row.needs_review : row[outcome];
}

/** Sums from the bottom up; the highest comes first, so that the lower ones are drawn over it. */
function stacked(rows: readonly (RateRow | null)[], drawn: readonly Outcome[]): (number | null)[][] {
  return drawn
    .map((_, upTo) =>
      rows.map((row) => row && drawn.slice(0, upTo + 1).reduce((sum, outcome) => sum + count(row, outcome), 0)),
    )
    .reverse();
}

function drawing(ink: Ink, drawn: readonly Outcome[], values: readonly (readonly (number | null)[])[]): Drawing {
  const bars = uPlot.paths.bars?.({ size: [0.72, 48] });
  const most = Math.max(1, ...(values[0] ?? []).map((one) => one ?? 0));
  return {
    end: most * 1.06,
    say: (value) => (Number.isInteger(value) ? whole(value) : ""),
    series: [...drawn].reverse().map((outcome) => {
      const { colour, hatch } = FILLS[outcome];
      const pattern = tile(ink(colour), hatch, ink("--card"));
      return {
        ...(bars && { paths: bars }),
        stroke: ink("--card"),
        width: 1,
        points: { show: false },
        // uPlot hands on whatever a canvas can be filled with; its types know only of colours.
        fill: (chart) => (chart.ctx.createPattern(pattern, "repeat") ?? ink(colour)) as unknown as CanvasGradient,
      };
    }),
  };
}
