import { Button } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api } from "../api/client";
import { fullTime } from "../words";
import classes from "./Fleet.module.css";
import { Panel } from "./Panel";
import { type Cause, causesKey } from "./queries";
import { fleetTexts } from "./texts";

const WEEK_MS = 7 * 86_400_000;

/** Leaves a cause out of alerts, or lets it in again. */
export function Muting({ cause }: { readonly cause: Cause }) {
  const queries = useQueryClient();
  const [note, setNote] = useState("");
  const [forGood, setForGood] = useState(false);
  const { cause: words } = fleetTexts;
  const params = { path: { cause: cause.id } };
  const turn = useMutation({
    mutationFn: (mute: boolean) => {
      if (!mute) return answered(api.DELETE("/api/v1/fleet/causes/{cause}/mute", { params }));
      const until = forGood ? null : new Date(Date.now() + WEEK_MS).toISOString();
      return answered(api.PUT("/api/v1/fleet/causes/{cause}/mute", { params, body: { until, note } }));
    },
    onSuccess: () => {
      setNote("");
      return queries.invalidateQueries({ queryKey: causesKey });
    },
  });
  return (
    <Panel title={cause.state === "muted" ? words.state.muted : words.mute} lead={words.muteLead}>
      {cause.state === "muted" ? (
        <div className={classes.form}>
          <p>
            {cause.muted_until ? words.mutedUntil(fullTime(new Date(cause.muted_until))) : words.mutedForGood}
            {cause.note && ` ${cause.note}`}
          </p>
          <Button variant="default" size="md" loading={turn.isPending} onClick={() => turn.mutate(false)}>
            {words.unmute}
          </Button>
        </div>
      ) : (
        <form
          className={classes.form}
          onSubmit={(event) => {
            event.preventDefault();
            turn.mutate(true);
          }}
        >
          <label className={classes.select}>
            {words.muteUntil}
            <select
              value={forGood ? "good" : "week"}
              onChange={({ currentTarget: { value } }) => setForGood(value === "good")}
            >
              <option value="week">{words.weekly}</option>
              <option value="good">{words.forGood}</option>
            </select>
          </label>
          <label className={classes.select}>
            {words.note}
            <input value={note} maxLength={500} onChange={({ currentTarget: { value } }) => setNote(value)} />
          </label>
          <Button type="submit" variant="default" size="md" loading={turn.isPending}>
            {words.mute}
          </Button>
        </form>
      )}
      {turn.isError && <p role="alert">{words.notChanged}</p>}
    </Panel>
  );
}
