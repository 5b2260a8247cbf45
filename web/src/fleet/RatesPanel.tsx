import { useMemo, useState } from "react";
import type uPlot from "uplot";
import { Link, useLocation } from "wouter";
import classes from "./Fleet.module.css";
import { axisEnd, day, interval, percent, shortDay, whole } from "./figures";
import { daysBetween, during, every, type Filters, searchOf, shifted } from "./filters";
import { LineSample, LOOKS, outline, ROWS, type Row, type Shape } from "./marks";
import { Panel, Table, TableSwitch } from "./Panel";
import { causesPath, OVERVIEW_PATH, ratesPath, withSearch } from "./paths";
import type { RateRow, Rates } from "./queries";
import { type Drawing, type Ink, TimeChart } from "./TimeChart";
import { fleetTexts } from "./texts";

interface Props {
  readonly rates: Rates;
  readonly filters: Filters;
}

/** The days of a chart, with what is known of each. */
export function useDays({ rates, filters }: Props) {
  const [, go] = useLocation();
  const unit = rates.group_by === "week" ? "week" : "day";
  const days = useMemo(() => every(unit, rates.first, rates.last), [unit, rates.first, rates.last]);
  const rows = useMemo(() => {
    const known = new Map(rates.items.map((row) => [row.key, row]));
    return days.map((one) => known.get(one) ?? null);
  }, [days, rates.items]);
  const spanFrom = (index: number) => {
    const start = days[index] ?? rates.first;
    const end = shifted(start, unit === "week" ? 6 : 0);
    return [start < rates.first ? rates.first : start, end > rates.last ? rates.last : end] as const;
  };
  return {
    unit,
    days,
    rows,
    failuresOf: (index: number) => causesPath(searchOf(during(filters, ...spanFrom(index)))),
    pick: (index: number) => go(causesPath(searchOf(during(filters, ...spanFrom(index))))),
    narrow: (from: number, to: number) => {
      if (daysBetween(days[from] ?? "", days[to] ?? "") > 0)
        go(withSearch(OVERVIEW_PATH, searchOf(during(filters, spanFrom(from)[0], spanFrom(to)[1]))));
    },
  };
}

/** The paper's results table over time. */
export function RatesPanel({ rates, filters }: Props) {
  const [asTable, setAsTable] = useState(false);
  const [pointed, setPointed] = useState<number | null>(null);
  const { unit, days, rows, failuresOf, pick, narrow } = useDays({ rates, filters });
  const values = useMemo(() => ROWS.flatMap((name) => series(rows, name)), [rows]);
  const draw = useMemo(() => (ink: Ink) => drawing(ink, rows), [rows]);
  const shown = pointed ?? rows.findLastIndex((row) => row !== null);
  const row = rows[shown];
  const label = fleetTexts.rates.label(day(rates.first), day(rates.last));
  const when = unit === "week" ? fleetTexts.chart.week : fleetTexts.chart.day;
  return (
    <Panel
      wide
      title={fleetTexts.rates.title}
      lead={fleetTexts.rates.lead}
      tools={
        <>
          <a href={ratesPath(filters, rates.group_by, "csv")} download>
            {fleetTexts.rates.csv}
          </a>
          <a href={ratesPath(filters, rates.group_by, "parquet")} download>
            {fleetTexts.rates.parquet}
          </a>
          <TableSwitch on={asTable} onChange={setAsTable} />
        </>
      }
    >
      {asTable ? (
        <Table label={label}>
          <thead>
            <tr>
              <th scope="col">{when}</th>
              {ROWS.map((name) => (
                <th key={name} scope="col">
                  {fleetTexts.measure[name]}
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
                  {ROWS.map((name) => (
                    <td key={name}>
                      <Share row={one} of={name} />
                    </td>
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
                {ROWS.map((name) => (
                  <li key={name}>
                    <LineSample row={name} /> {fleetTexts.measure[name]}: <Share row={row} of={name} />
                  </li>
                ))}
              </ul>
              {!row.sufficient && <p>{fleetTexts.onlyInterval(rates.minimum_n)}.</p>}
              <Link href={failuresOf(shown)}>{fleetTexts.chart.pick(shortDay(row.key))}</Link>
            </div>
          )}
          <p className={classes.hint}>{fleetTexts.chart.hint}</p>
        </>
      )}
    </Panel>
  );
}

/** A share with its interval; the interval alone, where n is small. */
export function Share({ row, of }: { readonly row: RateRow; readonly of: keyof RateRow["ci95"] }) {
  const rate = row.rates[of];
  return (
    <span className={classes.share}>
      {row.sufficient && rate !== null && <strong>{percent(rate)}</strong>} <span>{interval(row.ci95[of])}</span>
    </span>
  );
}

type Rows = readonly (RateRow | null)[];

function series(rows: Rows, name: Row): (number | null)[][] {
  const bound = (i: 0 | 1) => rows.map((row) => (row && row.missions > 0 ? row.ci95[name][i] : null));
  return [bound(1), bound(0), rows.map((row) => (row?.sufficient ? row.rates[name] : null))];
}

function drawing(ink: Ink, rows: Rows): Drawing {
  const sides = rows.flatMap((row) => (row ? ROWS.map((name) => row.ci95[name][1]) : []));
  const edge = { points: { show: false }, width: 0 };
  return {
    // A few days of which little is known must not flatten the others.
    end: axisEnd([axisEndOf(rows), ...(rows.some((row) => row?.sufficient) ? [] : sides)]),
    say: (value) => `${Math.round(value * 100)} %`,
    series: ROWS.flatMap((name) => {
      const { colour, dash } = LOOKS[name];
      return [edge, edge, { stroke: ink(colour), width: 2, dash, points: { show: false } }];
    }),
    bands: ROWS.map((name, i) => ({
      series: [3 * i + 1, 3 * i + 2] as [number, number],
      fill: `color-mix(in srgb, ${ink(LOOKS[name].colour)} 20%, transparent)`,
    })),
    overlay: (chart) => {
      ROWS.forEach((name, i) => {
        marks(chart, ink, rows, name, (i - 1) * 4);
      });
    },
  };
}

const axisEndOf = (rows: Rows): number =>
  Math.max(0, ...rows.flatMap((row) => (row?.sufficient ? [row.ci95.transfer[1]] : [])));

const RADIUS = 3.5;

/** Marks where a share is known, whiskers where only its interval is, or where no neighbour lets a band begin. */
function marks(chart: uPlot, ink: Ink, rows: Rows, name: Row, aside: number): void {
  const { ctx: pen } = chart;
  const { colour, shape } = LOOKS[name];
  const scale = devicePixelRatio;
  pen.save();
  pen.beginPath();
  pen.rect(chart.bbox.left, chart.bbox.top, chart.bbox.width, chart.bbox.height);
  pen.clip();
  pen.fillStyle = pen.strokeStyle = ink(colour);
  pen.lineWidth = 2 * scale;
  rows.forEach((row, i) => {
    const at = chart.data[0][i];
    if (!row || row.missions === 0 || at === undefined) return;
    const x = chart.valToPos(at, "x", true) + (row.sufficient ? 0 : aside * scale);
    const alone = !rows[i - 1] && !rows[i + 1];
    if (!row.sufficient || alone) {
      const [low, high] = row.ci95[name].map((bound) => chart.valToPos(bound, "y", true)) as [number, number];
      pen.beginPath();
      pen.moveTo(x, low);
      pen.lineTo(x, high);
      for (const y of [low, high]) {
        pen.moveTo(x - 3 * scale, y);
        pen.lineTo(x + 3 * scale, y);
      }
      pen.stroke();
    }
    const rate = row.rates[name];
    if (row.sufficient && rate !== null) dot(pen, shape, x, chart.valToPos(rate, "y", true), RADIUS * scale);
  });
  pen.restore();
}

function dot(pen: CanvasRenderingContext2D, shape: Shape, x: number, y: number, radius: number): void {
  pen.beginPath();
  if (shape === "circle") pen.arc(x, y, radius, 0, 2 * Math.PI);
  else for (const [dx, dy] of outline(shape)) pen.lineTo(x + dx * radius, y + dy * radius);
  pen.fill();
}
