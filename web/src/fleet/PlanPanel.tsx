import { Button } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api, Problem } from "../api/client";
import { fullTime } from "../words";
import classes from "./Fleet.module.css";
import { FloorPlan } from "./FloorPlan";
import { Panel } from "./Panel";
import own from "./PlanPanel.module.css";
import { type Inspected, inspectedQuery, lookAt } from "./queries";
import { fleetTexts } from "./texts";

const HOURS = [2, 24, 72, 168] as const;
const [SHORTEST, LONGEST] = [10, 500];

/** The floor plan, for those whom the owner lets; for others a way to ask. */
export function PlanPanel({ mission: { robot, map, mission, plan, plan_until } }: { readonly mission: Inspected }) {
  const queries = useQueryClient();
  const { plan: words } = fleetTexts;
  const again = () => queries.invalidateQueries({ queryKey: inspectedQuery(robot, map, mission).queryKey });
  const look = useMutation({
    mutationFn: () => lookAt(robot, map, mission),
    // Leave can have ended since this page was opened.
    onError: again,
  });
  const allowed = plan !== "none" && plan !== "asked";
  return (
    <Panel title={words.title}>
      <p>
        {words.access[plan]}
        {plan_until && ` (${words.until(fullTime(new Date(plan_until)))})`}
      </p>
      {look.isError && (
        <p role="alert" className={classes.refused}>
          {look.error instanceof Problem && look.error.status === 403 ? words.refused : words.failed}{" "}
          {look.error instanceof Problem && look.error.message}
        </p>
      )}
      {plan === "none" && <Ask robot={robot} asked={again} />}
      {allowed && !look.data && (
        <>
          <p className={classes.lead}>{words.logged}</p>
          <Button size="md" loading={look.isPending} onClick={() => look.mutate()}>
            {words.show}
          </Button>
        </>
      )}
      {allowed && look.data && <FloorPlan figure={look.data} />}
    </Panel>
  );
}

function Ask({ robot, asked }: { readonly robot: string; readonly asked: () => void }) {
  const { plan: words } = fleetTexts;
  const [reason, setReason] = useState("");
  const [hours, setHours] = useState<number>(24);
  const ask = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/fleet/grants", { body: { robot, reason: reason.trim(), hours } })),
    onSettled: asked,
  });
  return (
    <form
      className={own.ask}
      onSubmit={(event) => {
        event.preventDefault();
        ask.mutate();
      }}
    >
      <label>
        {words.reason}
        <textarea
          required
          rows={2}
          minLength={SHORTEST}
          maxLength={LONGEST}
          value={reason}
          onChange={({ currentTarget: { value } }) => setReason(value)}
        />
      </label>
      <label className={classes.select}>
        {words.hours}
        <select value={hours} onChange={({ currentTarget: { value } }) => setHours(Number(value))}>
          {HOURS.map((n) => (
            <option key={n} value={n}>
              {words.hoursOf(n)}
            </option>
          ))}
        </select>
      </label>
      <Button type="submit" size="md" loading={ask.isPending}>
        {words.ask}
      </Button>
      {ask.isError && (
        <p role="alert" className={classes.refused}>
          {ask.error.message}
        </p>
      )}
    </form>
  );
}
