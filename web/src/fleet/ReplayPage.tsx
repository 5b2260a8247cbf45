import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { Link } from "wouter";
import { isMissing } from "../api/client";
import { Failure, Loading, Nothing } from "../pages/states";
import { texts } from "../texts";
import classes from "./Fleet.module.css";
import { whole } from "./figures";
import { measureName, PairedTables } from "./PairedTables";
import { Panel, Table } from "./Panel";
import { missionPath, ROLLOUTS_PATH } from "./paths";
import { type Cell, type Paired, replayedQuery, replayQuery } from "./rollouts";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;

/** Stored missions run again: what differs, and which. */
export function ReplayPage({ name }: { readonly name: string }) {
  const found = useQuery(replayQuery(name));
  if (isMissing(found.error)) return <Nothing />;
  if (found.isError && !found.data)
    return <Failure what={fleetTexts.failed} error={found.error} retry={() => void found.refetch()} />;
  if (!found.data) return <Loading />;
  const { tables, done, missions, algorithm } = found.data;
  return (
    <>
      <title>{`${name} · ${texts.product}`}</title>
      <Link href={ROLLOUTS_PATH}>{words.replayBack}</Link>
      <h1 className={classes.code}>{name}</h1>
      <p className={classes.lead} aria-live="polite">
        {words.algorithm} {algorithm} · {words.progress(whole(done), whole(missions))}
      </p>
      <progress className={classes.progress} value={done} max={Math.max(missions, 1)} aria-label={words.missions} />
      <Panel title={words.paired} lead={words.pairedLead}>
        <PairedTables tables={tables} />
      </Panel>
      <Changed name={name} />
    </>
  );
}

function Changed({ name }: { readonly name: string }) {
  const [measure, setMeasure] = useState<Paired["measure"]>("taken");
  const [cell, setCell] = useState<Cell>("only_old");
  const { data } = useQuery(replayedQuery(name, measure, cell));
  return (
    <Panel title={words.changed}>
      <div className={classes.form}>
        <label className={classes.select}>
          {words.measure}
          <select value={measure} onChange={({ currentTarget: { value } }) => setMeasure(value as Paired["measure"])}>
            {(["taken", "transfer", "meta_occupancy", "meta_dividers"] as const).map((one) => (
              <option key={one} value={one}>
                {measureName(one)}
              </option>
            ))}
          </select>
        </label>
        <label className={classes.select}>
          {words.result}
          <select value={cell} onChange={({ currentTarget: { value } }) => setCell(value as Cell)}>
            <option value="only_old">{words.onlyOld}</option>
            <option value="only_new">{words.onlyNew}</option>
          </select>
        </label>
      </div>
      {data?.length === 0 && <p>{words.noneChanged}</p>}
      {data && data.length > 0 && (
        <Table label={words.changed}>
          <thead>
            <tr>
              {[fleetTexts.missions.mission, words.before, words.now].map((head) => (
                <th key={head} scope="col">
                  {head}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {data.map((one) => (
              <tr key={`${one.robot}/${one.map}/${one.mission}`}>
                <th scope="row">
                  <Link href={missionPath(one.robot, one.map, one.mission)}>
                    {fleetTexts.missions.name(one.mission, one.robot)}
                  </Link>
                </th>
                <td>{fleetTexts.outcome[one.outcome_then] ?? one.outcome_then}</td>
                <td>{fleetTexts.outcome[one.outcome_now] ?? one.outcome_now}</td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </Panel>
  );
}
