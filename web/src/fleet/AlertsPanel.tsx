import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api } from "../api/client";
import { Moment } from "../Moment";
import classes from "./Fleet.module.css";
import { interval, percent, whole } from "./figures";
import { Panel, Table } from "./Panel";
import { type Alert, alertsKey, alertsQuery, MEASURES, type Measure } from "./rollouts";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;

/** When to be told of a rate. */
export function AlertsPanel() {
  const { data } = useQuery(alertsQuery);
  return (
    <Panel title={words.alerts} lead={words.alertsLead}>
      {data?.length === 0 && <p>{words.noAlerts}</p>}
      {data && data.length > 0 && <List alerts={data} />}
      <Add />
    </Panel>
  );
}

function List({ alerts }: { readonly alerts: readonly Alert[] }) {
  const queries = useQueryClient();
  const remove = useMutation({
    mutationFn: (alert: string) => api.DELETE("/api/v1/fleet/alerts/{alert}", { params: { path: { alert } } }),
    onSettled: () => queries.invalidateQueries({ queryKey: alertsKey }),
  });
  return (
    <Table label={words.alerts}>
      <thead>
        <tr>
          {[
            words.name,
            words.measure,
            words.days,
            words.above,
            words.below,
            fleetTexts.inspect.state,
            words.now,
            words.lookedAt,
          ].map((head) => (
            <th key={head} scope="col">
              {head}
            </th>
          ))}
          <td />
        </tr>
      </thead>
      <tbody>
        {alerts.map((one) => (
          <tr key={one.name}>
            <th scope="row">{one.name}</th>
            <td>{[fleetTexts.measure[one.measure], ...selected(one)].join(" · ")}</td>
            <td>{one.days}</td>
            <td>{percent(one.above)}</td>
            <td>{percent(one.below)}</td>
            <td>
              <span className={classes.badge} data-alert={one.raised_at ? "raised" : "quiet"}>
                {one.raised_at ? words.raised : words.quiet}
              </span>
            </td>
            <td>{now(one)}</td>
            <td>{one.looked_at && <Moment at={one.looked_at} />}</td>
            <td>
              <button
                type="button"
                className={classes.plain}
                disabled={remove.isPending}
                aria-label={`${words.remove}: ${one.name}`}
                onClick={() => remove.mutate(one.name)}
              >
                {words.remove}
              </button>
            </td>
          </tr>
        ))}
      </tbody>
    </Table>
  );
}

const selected = ({ firmware, model, algorithm, size }: Alert): string[] =>
  [firmware, model, algorithm, size].filter((values) => values.length > 0).map((values) => values.join(", "));

function now({ figures }: Alert): string {
  if (!figures) return "–";
  return `${percent(figures.share)} (${interval(figures.ci95)}; n = ${whole(figures.missions)})`;
}

function Add() {
  const queries = useQueryClient();
  const [name, setName] = useState("");
  const [measure, setMeasure] = useState<Measure>("meta_dividers");
  const [days, setDays] = useState("1");
  const [least, setLeast] = useState("100");
  const [above, setAbove] = useState("5");
  const [below, setBelow] = useState("3");
  const add = useMutation({
    mutationFn: () => {
      const limits = { above: Number(above) / 100, below: Number(below) / 100 };
      const which = { firmware: [], model: [], algorithm: [], size: [] };
      const body = { name, measure, days: Number(days), minimum_n: Number(least), ...limits, ...which };
      return answered(api.POST("/api/v1/fleet/alerts", { body }));
    },
    onSuccess: () => {
      setName("");
      return queries.invalidateQueries({ queryKey: alertsKey });
    },
  });
  const number = (label: string, value: string, change: (value: string) => void, min: string, max: string) => (
    <label className={classes.select}>
      {label}
      <input
        type="number"
        required
        min={min}
        max={max}
        step="any"
        value={value}
        onChange={({ currentTarget }) => change(currentTarget.value)}
      />
    </label>
  );
  return (
    <form
      className={classes.form}
      aria-label={words.add}
      onSubmit={(event) => {
        event.preventDefault();
        add.mutate();
      }}
    >
      <label className={classes.select}>
        {words.name}
        <input required maxLength={64} value={name} onChange={({ currentTarget: { value } }) => setName(value)} />
      </label>
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
      {number(words.days, days, setDays, "1", "90")}
      {number(words.least, least, setLeast, "30", "1000000")}
      {number(words.above, above, setAbove, "0", "100")}
      {number(words.below, below, setBelow, "0", "100")}
      <Button type="submit" variant="default" size="md" loading={add.isPending}>
        {words.add}
      </Button>
      {add.isError && <p role="alert">{add.error.message}</p>}
    </form>
  );
}
