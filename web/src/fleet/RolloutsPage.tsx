import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { Link, useLocation } from "wouter";
import { answered, api } from "../api/client";
import { Moment } from "../Moment";
import { texts } from "../texts";
import classes from "./Fleet.module.css";
import { Panel, Table } from "./Panel";
import { rolloutPath } from "./paths";
import { Replays } from "./Replays";
import { MEASURES, type Measure, type Rollout, rolloutsKey, rolloutsQuery } from "./rollouts";
import { CODES_OWN, isUsable, SettingFields, settingOf } from "./SettingFields";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;
/** What is tried, was tried, and a form to try something else. */
export function RolloutsPage() {
  const { data } = useQuery(rolloutsQuery);
  const running = data?.some(({ state }) => state === "running") ?? true;
  return (
    <>
      <title>{`${words.title} · ${texts.product}`}</title>
      <h1>{words.title}</h1>
      <p className={classes.lead}>{words.lead}</p>
      {data && <Panel title={words.title}>{data.length === 0 ? <p>{words.none}</p> : <List rollouts={data} />}</Panel>}
      {!running && <Begin />}
      <Replays />
    </>
  );
}

export function StateWord({ of }: { readonly of: Rollout }) {
  return (
    <span className={classes.badge} data-rollout={of.in_force ? "in_force" : of.state}>
      {words.state[of.state]}
      {of.in_force && `, ${words.inForce}`}
      {of.withdrawn_at && `, ${words.withdrawn}`}
    </span>
  );
}

function List({ rollouts }: { readonly rollouts: readonly Rollout[] }) {
  return (
    <Table label={words.title}>
      <thead>
        <tr>
          {[words.name, fleetTexts.inspect.state, words.stageHead, words.begun, words.ended].map((head) => (
            <th key={head} scope="col">
              {head}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {rollouts.map((one) => (
          <tr key={one.name}>
            <th scope="row">
              <Link href={rolloutPath(one.name)}>{one.name}</Link>
            </th>
            <td>
              <StateWord of={one} />
            </td>
            <td>{words.stage[one.stage]}</td>
            <td>
              <Moment at={one.created_at} />
            </td>
            <td>{one.ended_at && <Moment at={one.ended_at} />}</td>
          </tr>
        ))}
      </tbody>
    </Table>
  );
}

function Begin() {
  const queries = useQueryClient();
  const [, go] = useLocation();
  const [name, setName] = useState("");
  const [setting, setSetting] = useState(CODES_OWN);
  const [measure, setMeasure] = useState<Measure>("meta_dividers");
  const [points, setPoints] = useState("1");
  const [least, setLeast] = useState("300");
  const [automatic, setAutomatic] = useState(false);
  const begin = useMutation({
    mutationFn: () => {
      const gates = [{ measure, margin: Number(points) / 100, minimum_n: Number(least) }];
      const body = { name, ...settingOf(setting), gates, automatic };
      return answered(api.POST("/api/v1/fleet/rollouts", { body }));
    },
    onSuccess: async (made) => {
      await queries.invalidateQueries({ queryKey: rolloutsKey });
      go(rolloutPath(made.name));
    },
  });
  const wrong = !isUsable(setting);
  return (
    <Panel title={words.begin} lead={words.beginLead}>
      <form
        className={classes.form}
        onSubmit={(event) => {
          event.preventDefault();
          begin.mutate();
        }}
      >
        <label className={classes.select}>
          {words.name}
          <input
            required
            pattern="[a-z0-9][a-z0-9\-]{0,19}"
            title={words.nameHint}
            value={name}
            onChange={({ currentTarget: { value } }) => setName(value)}
          />
        </label>
        <SettingFields setting={setting} change={setSetting} />
        <label className={classes.select}>
          {words.measure}
          <select value={measure} onChange={({ currentTarget: { value } }) => setMeasure(value as Measure)}>
            {MEASURES.map((one) => (
              <option key={one} value={one}>
                {fleetTexts.measure[one]}
              </option>
            ))}
          </select>
        </label>
        <label className={classes.select}>
          {words.margin}
          <input
            type="number"
            min="0.1"
            max="50"
            step="0.1"
            required
            value={points}
            onChange={({ currentTarget: { value } }) => setPoints(value)}
          />
        </label>
        <label className={classes.select}>
          {words.minimum}
          <input
            type="number"
            min="30"
            required
            value={least}
            onChange={({ currentTarget: { value } }) => setLeast(value)}
          />
        </label>
        <label className={classes.check}>
          <input
            type="checkbox"
            checked={automatic}
            onChange={({ currentTarget }) => setAutomatic(currentTarget.checked)}
          />
          {words.automatic}
        </label>
        <Button type="submit" size="md" disabled={wrong} loading={begin.isPending}>
          {words.startButton}
        </Button>
      </form>
      {wrong && <p role="alert">{words.paramsWrong}</p>}
      {begin.isError && <p role="alert">{begin.error.message}</p>}
    </Panel>
  );
}
