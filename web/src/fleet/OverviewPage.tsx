import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { Link } from "wouter";
import { Failure, Loading } from "../pages/states";
import { texts } from "../texts";
import { CauseList } from "./CauseList";
import { FilterBar } from "./FilterBar";
import classes from "./Fleet.module.css";
import { day, interval, percent, whole } from "./figures";
import { every, type Filters, step } from "./filters";
import { GroupsPanel } from "./GroupsPanel";
import { MissionTable } from "./MissionTable";
import { ROWS } from "./marks";
import { OutcomesPanel } from "./OutcomesPanel";
import { Panel, Table } from "./Panel";
import { causesPath } from "./paths";
import { causesQuery, latestQuery, type Measure, type RateRow, ratesQuery, worstQuery } from "./queries";
import { RatesPanel, Share } from "./RatesPanel";
import { TodayPanel } from "./TodayPanel";
import { fleetTexts } from "./texts";
import { useFilters } from "./useFilters";

const CAUSES = 5;
const WORST = 8;
const WHOLE: readonly Measure[] = [...ROWS, "needs_review", "reverted", "parked", "escapes"];

/** How the fleet does: the rates, what missions come to, and what they fail by. */
export function OverviewPage() {
  const { filters, search, change } = useFilters();
  const rates = useQuery(ratesQuery(filters, step(filters, new Date())));
  if (rates.isError && !rates.data)
    return <Failure what={fleetTexts.failed} error={rates.error} retry={() => void rates.refetch()} />;
  const { data } = rates;
  return (
    <>
      <title>{`${fleetTexts.title} · ${texts.product}`}</title>
      <h1>{fleetTexts.title}</h1>
      <FilterBar filters={filters} change={change} />
      {!data && <Loading />}
      {data && (
        <>
          <p className={classes.counts} aria-live="polite">
            {day(data.first)} – {day(data.last)}:{" "}
            {fleetTexts.of(whole(data.total.missions), fleetTexts.robots(data.total.robots))}
            {data.waiting > 0 && ` · ${fleetTexts.waiting(data.waiting)}`}
          </p>
          {data.total.missions > 0 && <Whole total={data.total} />}
          {data.total.missions + data.total.parked === 0 ? (
            <p>{fleetTexts.chart.empty}</p>
          ) : (
            <div className={classes.grid}>
              <RatesPanel rates={data} filters={filters} />
              <TopCauses filters={filters} search={search} />
              <TodayPanel filters={filters} />
              <OutcomesPanel rates={data} filters={filters} />
              <GroupsPanel filters={filters} change={change} />
              <WorstRobots filters={filters} />
              <Latest filters={filters} />
            </div>
          )}
        </>
      )}
    </>
  );
}

/** All missions of the selection as one. */
function Whole({ total }: { readonly total: RateRow }) {
  return (
    <dl className={classes.facts}>
      {WHOLE.map((name) => (
        <div key={name}>
          <dt>{fleetTexts.measure[name]}</dt>
          <dd>
            <Share row={total} of={name} />
          </dd>
        </div>
      ))}
    </dl>
  );
}

function TopCauses({ filters, search }: { readonly filters: Filters; readonly search: string }) {
  const { data } = useQuery(causesQuery(filters, null));
  const days = useMemo(() => (data ? every("day", data.first, data.last) : []), [data]);
  const { cause: words } = fleetTexts;
  if (!data) return null;
  return (
    <Panel wide title={words.title} lead={words.lead} tools={<Link href={causesPath(search)}>{words.all}</Link>}>
      {data.items.length === 0 ? (
        <p>{words.none}</p>
      ) : (
        <CauseList causes={data.items.slice(0, CAUSES)} days={days} search={search} />
      )}
    </Panel>
  );
}

function WorstRobots({ filters }: { readonly filters: Filters }) {
  const { data } = useQuery(worstQuery(filters, WORST));
  const { worst: words } = fleetTexts;
  if (!data) return null;
  return (
    <Panel title={words.title} lead={words.lead}>
      {data.length === 0 ? (
        <p>{words.none}</p>
      ) : (
        <Table label={words.title}>
          <thead>
            <tr>
              {[
                fleetTexts.missions.robot,
                words.failed,
                words.interval,
                fleetTexts.chart.nHead,
                fleetTexts.measure.reverted,
                words.escapes,
              ].map((head) => (
                <th key={head} scope="col">
                  {head}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {data.map((row) => (
              <tr key={row.robot}>
                <th scope="row">{row.robot}</th>
                <td>
                  {row.failed} ({percent(row.failure_rate)})
                </td>
                <td>{interval(row.ci95)}</td>
                <td>{row.missions}</td>
                <td>{row.reverted}</td>
                <td>{row.escapes}</td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </Panel>
  );
}

function Latest({ filters }: { readonly filters: Filters }) {
  const { data } = useQuery(latestQuery(filters));
  const { missions: words } = fleetTexts;
  if (!data) return null;
  return (
    <Panel title={words.latest} lead={words.latestLead}>
      {data.length === 0 ? <p>{words.none}</p> : <MissionTable label={words.latest} missions={data} />}
    </Panel>
  );
}
