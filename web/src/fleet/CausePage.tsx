import { Button } from "@mantine/core";
import { useInfiniteQuery, useQuery } from "@tanstack/react-query";
import { Link } from "wouter";
import { isMissing } from "../api/client";
import { Moment } from "../Moment";
import { Failure, Loading, Nothing } from "../pages/states";
import { texts } from "../texts";
import { nameOf, StateBadge } from "./CauseList";
import { FilterBar } from "./FilterBar";
import classes from "./Fleet.module.css";
import { percent, said, whole } from "./figures";
import { every, spanOf } from "./filters";
import { MissionTable } from "./MissionTable";
import { Muting } from "./Muting";
import { Panel, Table } from "./Panel";
import { causesPath } from "./paths";
import { causeQuery, failuresQuery } from "./queries";
import { Sparkline } from "./Sparkline";
import { fleetTexts } from "./texts";
import { useFilters } from "./useFilters";

const BY = ["firmware", "model", "size"] as const;

/** One group of failures: since when, where, and its missions. */
export function CausePage({ id }: { readonly id: string }) {
  const { filters, search, change } = useFilters();
  const found = useQuery(causeQuery(filters, id));
  const { cause: words } = fleetTexts;
  if (isMissing(found.error)) return <Nothing />;
  if (found.isError && !found.data)
    return <Failure what={fleetTexts.failed} error={found.error} retry={() => void found.refetch()} />;
  if (!found.data) return <Loading />;
  const one = found.data;
  const { from, to } = spanOf(filters, new Date());
  return (
    <>
      <title>{`${nameOf(one)} · ${texts.product}`}</title>
      <Link href={causesPath(search)}>{words.back}</Link>
      <h1 className={classes.code}>
        {nameOf(one)} <StateBadge state={one.state} />
      </h1>
      <p className={classes.lead}>
        {words.stage[one.stage] ?? one.stage} · {words.algorithm} {said(one.algorithm)}
      </p>
      <FilterBar filters={filters} change={change} />
      <dl className={classes.facts}>
        <Fact name={words.ofFailed}>{percent(one.share)}</Fact>
        <Fact name={fleetTexts.missions.title}>{whole(one.missions)}</Fact>
        <Fact name={fleetTexts.chart.robotsHead}>{whole(one.robots)}</Fact>
        <Fact name={words.first}>
          <Moment at={one.first_seen} />
        </Fact>
        <Fact name={words.last}>
          <Moment at={one.last_seen} />
        </Fact>
        {one.returned_at && (
          <Fact name={words.returned}>
            <Moment at={one.returned_at} />
          </Fact>
        )}
        <Fact name={fleetTexts.measure.needs_review}>{whole(one.needs_review)}</Fact>
        <Fact name={fleetTexts.measure.reverted}>{whole(one.reverted)}</Fact>
        <Fact name={fleetTexts.measure.parked}>{whole(one.parked)}</Fact>
        <Fact name={words.settled}>{whole(one.settled)}</Fact>
        <Fact name={words.trend}>
          <Sparkline trend={one.trend} days={every("day", from, to)} />
        </Fact>
      </dl>
      <Panel title={words.by}>
        <div className={classes.spread}>
          {BY.map((name) => (
            <Spread key={name} title={fleetTexts.filter[name]} counts={one[name]} all={one.missions} />
          ))}
        </div>
      </Panel>
      <Missions id={id} />
      <Muting cause={one} />
    </>
  );
}

function Fact({ name, children }: { readonly name: string; readonly children: React.ReactNode }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}

interface SpreadProps {
  readonly title: string;
  readonly counts: Readonly<Record<string, number>>;
  readonly all: number;
}

/** How its missions are spread over one kind of value, the most first. */
function Spread({ title, counts, all }: SpreadProps) {
  const rows = Object.entries(counts).sort(([, a], [, b]) => b - a);
  return (
    <Table label={title}>
      <thead>
        <tr>
          <th scope="col">{title}</th>
          <th scope="col">{fleetTexts.missions.title}</th>
          <td aria-hidden="true" />
        </tr>
      </thead>
      <tbody>
        {rows.map(([value, n]) => (
          <tr key={value}>
            <th scope="row">{said(value)}</th>
            <td>
              {whole(n)} ({percent(n / Math.max(all, 1))})
            </td>
            <td className={classes.barCell} aria-hidden="true">
              <span className={classes.bar} style={{ width: `${(100 * n) / Math.max(all, 1)}%` }} />
            </td>
          </tr>
        ))}
      </tbody>
    </Table>
  );
}

function Missions({ id }: { readonly id: string }) {
  const { filters } = useFilters();
  const found = useInfiniteQuery(failuresQuery(filters, id));
  const missions = found.data?.pages.flatMap(({ items }) => items) ?? [];
  const { missions: words } = fleetTexts;
  return (
    <Panel title={fleetTexts.cause.missions}>
      {found.isError && <p role="alert">{fleetTexts.failed}</p>}
      {found.data && missions.length === 0 && <p>{words.none}</p>}
      {missions.length > 0 && <MissionTable label={fleetTexts.cause.missions} missions={missions} />}
      {found.hasNextPage && (
        <Button
          variant="default"
          size="md"
          loading={found.isFetchingNextPage}
          onClick={() => void found.fetchNextPage()}
        >
          {words.more}
        </Button>
      )}
    </Panel>
  );
}
