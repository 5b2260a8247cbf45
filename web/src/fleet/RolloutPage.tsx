import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { Link } from "wouter";
import { answered, api, isMissing } from "../api/client";
import { Moment } from "../Moment";
import { Failure, Loading, Nothing } from "../pages/states";
import { texts } from "../texts";
import { ChangedMaps } from "./ChangedMaps";
import classes from "./Fleet.module.css";
import { axisEnd, interval, percent, points, whole } from "./figures";
import { LOOKS } from "./marks";
import { chance, PairedTables } from "./PairedTables";
import { Panel, Table } from "./Panel";
import { OVERVIEW_PATH, ROLLOUTS_PATH } from "./paths";
import own from "./RolloutPage.module.css";
import { StateWord } from "./RolloutsPage";
import { type Gate, type Report, rolloutQuery, rolloutsKey } from "./rollouts";
import { fleetTexts } from "./texts";
import { Whiskers } from "./Whiskers";

const words = fleetTexts.rollouts;
const STAGES = [0, 1, 5, 25, 100] as const;

/** How far a rollout has come, by which numbers, and what can be done about it. */
export function RolloutPage({ name }: { readonly name: string }) {
  const found = useQuery(rolloutQuery(name));
  if (isMissing(found.error)) return <Nothing />;
  if (found.isError && !found.data)
    return <Failure what={fleetTexts.failed} error={found.error} retry={() => void found.refetch()} />;
  if (!found.data) return <Loading />;
  const one = found.data;
  const compared = one.tables.some((table) => table.both + table.only_old + table.only_new + table.neither > 0);
  return (
    <>
      <title>{`${name} · ${texts.product}`}</title>
      <Link href={ROLLOUTS_PATH}>{words.back}</Link>
      <h1 className={classes.code}>
        {name} <StateWord of={one} />
      </h1>
      <Stages of={one} />
      {one.reason && <p className={classes.refused}>{one.reason}</p>}
      <dl className={classes.facts}>
        <Fact name={words.resolvers}>{one.resolvers.map((r) => fleetTexts.measure[r]).join(", ") || "–"}</Fact>
        <Fact name={words.setting}>
          {Object.entries(one.params)
            .map(([key, value]) => `${key} = ${JSON.stringify(value)}`)
            .join(", ") || words.codesOwn}
        </Fact>
        <Fact name={words.begun}>
          <Moment at={one.created_at} />
        </Fact>
        <Fact name={words.algorithm}>
          <Link href={`${OVERVIEW_PATH}?algorithm=${encodeURIComponent(one.algorithm)}`}>{one.algorithm}</Link>
        </Fact>
      </dl>
      <Panel title={words.gates} lead={words.gatesLead}>
        <p className={classes.counts} aria-live="polite">
          <strong>{words.verdict[one.verdict]}</strong>
          {one.state === "running" && ` · ${words.nextLook(whole(one.missions), whole(one.next_look))}`}
          {one.state === "running" && one.stage === 0 && (
            <>
              {" "}
              {words.beside(whole(one.beside.done), whole(one.beside.waiting))}
              {one.beside.errors > 0 && words.besideErrors(one.beside.errors)}
            </>
          )}
        </p>
        <Gates gates={one.report} />
      </Panel>
      {compared && (
        <Panel title={words.paired} lead={words.pairedLead}>
          <PairedTables tables={one.tables} />
        </Panel>
      )}
      <Looks of={one} />
      {one.changed_maps > 0 && <ChangedMaps of={one} />}
      <Acting of={one} />
    </>
  );
}

function Fact({ name, children }: { readonly name: string; readonly children: ReactNode }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  );
}

function Stages({ of }: { readonly of: Report }) {
  return (
    <ol className={own.stages} aria-label={words.stageHead}>
      {STAGES.map((stage) => (
        <li
          key={stage}
          data-reached={stage <= of.stage}
          data-state={of.state}
          aria-current={stage === of.stage ? "step" : undefined}
        >
          {words.stage[stage]}
        </li>
      ))}
    </ol>
  );
}

function Gates({ gates }: { readonly gates: readonly Gate[] }) {
  const end = axisEnd(gates.flatMap((gate) => [gate.old.ci95[1], gate.new.ci95[1]].filter((share) => share < 1)));
  return (
    <Table label={words.gates}>
      <thead>
        <tr>
          <th scope="col">{words.measure}</th>
          <th scope="col">{words.result}</th>
          <th scope="col">{words.old}</th>
          <th scope="col">{words.new}</th>
          <td aria-hidden="true" />
          <th scope="col">{words.difference}</th>
          <th scope="col">{words.p}</th>
          <th scope="col">{words.more}</th>
        </tr>
      </thead>
      <tbody>
        {gates.map((gate) => (
          <tr key={gate.measure} data-verdict={gate.verdict}>
            <th scope="row">
              {fleetTexts.measure[gate.measure]}
              <span className={own.below}>{words.atMost(points(gate.margin))}</span>
            </th>
            <td className={own.verdictCell}>{words.verdict[gate.verdict]}</td>
            <td>
              <Arm arm={gate.old} />
            </td>
            <td>
              <Arm arm={gate.new} />
            </td>
            <td className={classes.plot} aria-hidden="true">
              <Whiskers
                end={end}
                marks={[
                  { interval: gate.old.ci95, point: gate.old.share, ...LOOKS.meta_occupancy },
                  { interval: gate.new.ci95, point: gate.new.share, ...LOOKS.transfer },
                ]}
              />
            </td>
            <td>{gate.difference === null ? "–" : words.points(points(gate.ci95[0]), points(gate.ci95[1]))}</td>
            <td>{gate.difference === null ? "–" : chance(gate.p)}</td>
            <td>{gate.verdict === "passed" || gate.verdict === "failed" ? "–" : needed(gate)}</td>
          </tr>
        ))}
      </tbody>
    </Table>
  );
}

function needed({ more, difference }: Gate): string {
  if (difference === null) return "–";
  if (more === null) return words.moreNever;
  return more === 0 ? words.enough : words.moreOf(whole(more));
}

function Arm({ arm }: { readonly arm: Gate["old"] }) {
  if (arm.share === null) return "–";
  return (
    <span className={classes.share}>
      <strong>{percent(arm.share)}</strong> <span>({interval(arm.ci95)})</span>
      <span className={own.below}>
        {whole(arm.count)} / {whole(arm.missions)}, {fleetTexts.robots(arm.robots)}
      </span>
    </span>
  );
}

function Looks({ of }: { readonly of: Report }) {
  return (
    <Panel title={words.looks}>
      {of.looks.length === 0 ? (
        <p>{words.noLooks}</p>
      ) : (
        <Table label={words.looks}>
          <thead>
            <tr>
              {[words.look, words.stageHead, words.missions, words.at, words.difference, words.result].map((head) => (
                <th key={head} scope="col">
                  {head}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {of.looks.map((look) => (
              <tr key={look.number}>
                <th scope="row">{look.number}</th>
                <td>{words.stage[look.stage]}</td>
                <td>{whole(look.missions)}</td>
                <td>
                  <Moment at={look.at} />
                </td>
                <td>
                  {look.gates
                    .map(
                      (gate) =>
                        `${fleetTexts.measure[gate.measure]}: ${words.points(points(gate.low), points(gate.high))}`,
                    )
                    .join("; ")}
                </td>
                <td>{words.verdict[look.verdict]}</td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </Panel>
  );
}

/** Going on, and ending it. */
function Acting({ of }: { readonly of: Report }) {
  const queries = useQueryClient();
  const [reason, setReason] = useState("");
  const path = { rollout: of.name };
  const act = useMutation({
    mutationFn: (what: "advance" | "end") =>
      what === "advance"
        ? answered(api.POST("/api/v1/fleet/rollouts/{rollout}/advance", { params: { path } }))
        : answered(api.POST("/api/v1/fleet/rollouts/{rollout}/end", { params: { path }, body: { reason } })),
    onSuccess: () => setReason(""),
    onSettled: () => queries.invalidateQueries({ queryKey: rolloutsKey }),
  });
  const next = STAGES.find((stage) => stage > of.stage);
  const isOver = of.state !== "running" && !of.in_force;
  if (isOver) return null;
  return (
    <Panel title={of.state === "running" ? words.act : words.withdraw}>
      {of.state === "running" && next !== undefined && (
        <p className={classes.goOn}>
          <Button
            size="md"
            disabled={of.verdict !== "passed"}
            loading={act.isPending}
            onClick={() => act.mutate("advance")}
          >
            {words.advance(words.stage[next] ?? "")}
          </Button>
        </p>
      )}
      <p className={classes.lead}>{words.endLead}</p>
      <form
        className={classes.form}
        onSubmit={(event) => {
          event.preventDefault();
          act.mutate("end");
        }}
      >
        <label className={classes.select}>
          {words.why}
          <input
            required
            minLength={3}
            maxLength={500}
            value={reason}
            onChange={({ currentTarget: { value } }) => setReason(value)}
          />
        </label>
        <Button type="submit" variant="default" size="md" loading={act.isPending}>
          {of.state === "running" ? words.end : words.withdraw}
        </Button>
      </form>
      {act.isError && <p role="alert">{act.error.message}</p>}
    </Panel>
  );
}
