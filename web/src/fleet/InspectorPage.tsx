import { useQuery } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { Link, useLocation } from "wouter";
import { isMissing } from "../api/client";
import { Moment } from "../Moment";
import { Failure, Loading, Nothing } from "../pages/states";
import { texts } from "../texts";
import classes from "./Fleet.module.css";
import { percent, said, whole } from "./figures";
import own from "./InspectorPage.module.css";
import { ROWS } from "./marks";
import { Panel, Table } from "./Panel";
import { PlanPanel } from "./PlanPanel";
import { causePath, missionPath, withSearch } from "./paths";
import { type Inspected, inspectedQuery, stepsQuery } from "./queries";
import { fleetTexts } from "./texts";
import { useFilters } from "./useFilters";

interface Props {
  readonly robot: string;
  readonly map: string;
  readonly mission: string;
}

/** One mission: what came of it and why, in numbers; its floor plan with the owner's leave. */
export function InspectorPage({ robot, map, mission }: Props) {
  const found = useQuery(inspectedQuery(robot, map, mission));
  const { inspect: words } = fleetTexts;
  if (isMissing(found.error)) return <Nothing />;
  if (found.isError && !found.data)
    return <Failure what={fleetTexts.failed} error={found.error} retry={() => void found.refetch()} />;
  if (!found.data) return <Loading />;
  const one = found.data;
  return (
    <>
      <title>{`${words.title(mission)} · ${texts.product}`}</title>
      <h1 className={classes.code}>{words.title(mission)}</h1>
      <p className={classes.lead}>{words.of(robot, map)}</p>
      <History robot={robot} map={map} mission={mission} />
      <Facts mission={one} />
      <Rooms rooms={one.rooms} />
      <Conflicts conflicts={one.conflicts} />
      {one.error && (
        <Panel title={words.error}>
          {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls takes the focus */}
          <pre className={own.error} tabIndex={0}>
            {one.error}
          </pre>
        </Panel>
      )}
      <PlanPanel key={one.mission} mission={one} />
      <Timings timings={one.timings_ms} />
    </>
  );
}

/** Steps through the missions of a map, by slider or one by one. */
function History({ robot, map, mission }: Props) {
  const { data } = useQuery(stepsQuery(robot, map));
  const { search } = useFilters();
  const [, go] = useLocation();
  const at = data?.findIndex((step) => step.mission === mission) ?? -1;
  const [dragged, setDragged] = useState(at);
  useEffect(() => setDragged(at), [at]);
  if (!data || at < 0) return null;
  const { inspect: words } = fleetTexts;
  const open = (index: number) => {
    const step = data[index];
    if (step && index !== at) go(withSearch(missionPath(robot, map, step.mission), search));
  };
  const step = data[dragged] ?? data[at];
  const name = step && words.step(step.mission, outcomeOf(step.outcome));
  return (
    <div className={own.history}>
      <button type="button" className={classes.plain} disabled={at === 0} onClick={() => open(at - 1)}>
        {words.older}
      </button>
      <input
        type="range"
        min={0}
        max={data.length - 1}
        value={dragged < 0 ? at : dragged}
        aria-label={words.history}
        aria-valuetext={name}
        onChange={({ currentTarget: { value } }) => setDragged(Number(value))}
        onPointerUp={() => open(dragged)}
        onKeyUp={() => open(dragged)}
      />
      <button type="button" className={classes.plain} disabled={at === data.length - 1} onClick={() => open(at + 1)}>
        {words.newer}
      </button>
      <output>{name}</output>
    </div>
  );
}

const outcomeOf = (outcome: string | null): string =>
  outcome === null ? fleetTexts.inspect.notDone : (fleetTexts.outcome[outcome] ?? outcome);

function Facts({ mission: one }: { readonly mission: Inspected }) {
  const { search } = useFilters();
  const { inspect: words, missions } = fleetTexts;
  const rows: readonly (readonly [string, React.ReactNode])[] = [
    [missions.outcome, outcomeOf(one.outcome)],
    ...ROWS.flatMap((name) =>
      one.ablation
        ? [[fleetTexts.measure[name], one.ablation[name] ? `✓ ${words.passes}` : `✗ ${words.fails}`] as const]
        : [],
    ),
    ...(one.cause
      ? [
          [
            words.cause,
            <Link key="cause" href={causePath(one.cause, search)}>
              {words.group}
            </Link>,
          ] as const,
        ]
      : []),
    [words.versions, `${one.base_version ?? "–"} → ${one.version ?? "–"}`],
    [words.tracked, one.tracked.join(", ") || words.untracked],
    [missions.firmware, said(one.firmware ?? "")],
    [missions.model, said(one.model ?? "")],
    [missions.algorithm, said(one.algorithm ?? "")],
    [words.received, <Moment key="received" at={one.received_at} />],
    ...(one.finished_at ? [[missions.finished, <Moment key="finished" at={one.finished_at} />] as const] : []),
    [words.attempts, whole(one.attempts)],
    [words.found, whole(one.discovered_rooms)],
    [words.warnings, whole(one.warnings)],
    ...(one.escaped_at ? [[words.escaped, <Moment key="escaped" at={one.escaped_at} />] as const] : []),
  ];
  return (
    <Panel title={words.facts}>
      <dl className={classes.facts}>
        {rows.map(([name, value]) => (
          <div key={name}>
            <dt>{name}</dt>
            <dd>{value}</dd>
          </div>
        ))}
      </dl>
    </Panel>
  );
}

function Rooms({ rooms }: { readonly rooms: Inspected["rooms"] }) {
  const { inspect: words } = fleetTexts;
  return (
    <Panel title={words.rooms} lead={words.roomsLead}>
      {rooms.length === 0 ? (
        <p>{words.noRooms}</p>
      ) : (
        <Table label={words.rooms}>
          <thead>
            <tr>
              <th scope="col">{words.room}</th>
              <th scope="col">{words.precision}</th>
              <th scope="col">{words.recall}</th>
              <th scope="col">{words.result}</th>
            </tr>
          </thead>
          <tbody>
            {rooms.map((room) => (
              <tr key={room.id}>
                <th scope="row">{room.id}</th>
                <Scored share={room.precision} />
                <Scored share={room.recall} />
                <td>{!room.visited ? words.notVisited : room.passed ? `✓ ${words.passes}` : `✗ ${words.fails}`}</td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </Panel>
  );
}

function Scored({ share }: { readonly share: number }) {
  return (
    <td>
      <span className={own.scored}>
        {percent(share)}
        <span className={classes.track} aria-hidden="true">
          <span className={classes.bar} style={{ width: `${100 * share}%` }} />
        </span>
      </span>
    </td>
  );
}

function Conflicts({ conflicts }: { readonly conflicts: Inspected["conflicts"] }) {
  const { inspect: words } = fleetTexts;
  return (
    <Panel title={words.conflicts}>
      {conflicts.length === 0 ? (
        <p>{words.noConflicts}</p>
      ) : (
        <Table label={words.conflicts}>
          <thead>
            <tr>
              <th scope="col">{fleetTexts.cause.what}</th>
              <th scope="col">{words.rooms}</th>
              <th scope="col">{words.state}</th>
              <th scope="col">{words.answer}</th>
            </tr>
          </thead>
          <tbody>
            {conflicts.map((one) => (
              <tr key={one.id}>
                <th scope="row">
                  {one.kind} / {one.cause}
                </th>
                <td>{one.rooms.map(({ id }) => id).join(", ")}</td>
                <td>{one.state}</td>
                <td>
                  {one.response ?? words.unanswered} {one.decided_at && <Moment at={one.decided_at} />}
                </td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </Panel>
  );
}

function Timings({ timings }: { readonly timings: Inspected["timings_ms"] }) {
  const { inspect: words } = fleetTexts;
  const rows = Object.entries(timings);
  const most = Math.max(1, ...rows.map(([, ms]) => ms));
  return (
    <Panel title={words.timings}>
      {rows.length === 0 ? (
        <p>{words.noTimings}</p>
      ) : (
        <Table label={words.timings}>
          <thead>
            <tr>
              <th scope="col">{words.stage}</th>
              <th scope="col">{words.timings}</th>
              <td aria-hidden="true" />
            </tr>
          </thead>
          <tbody>
            {rows.map(([stage, ms]) => (
              <tr key={stage}>
                <th scope="row">{stage}</th>
                <td>{words.ms(whole(Math.round(ms)))}</td>
                <td className={classes.barCell} aria-hidden="true">
                  <span className={classes.bar} style={{ width: `${(100 * ms) / most}%` }} />
                </td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </Panel>
  );
}
