import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { Link, useLocation } from "wouter";
import { answered, api } from "../api/client";
import { Moment } from "../Moment";
import classes from "./Fleet.module.css";
import { whole } from "./figures";
import { Panel, Table } from "./Panel";
import { replayPath } from "./paths";
import { replaysQuery } from "./rollouts";
import { CODES_OWN, isUsable, SettingFields, settingOf } from "./SettingFields";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;

/** Stored missions run again, and a form to do so. */
export function Replays() {
  const { data } = useQuery(replaysQuery);
  if (!data) return null;
  return (
    <Panel title={words.replays} lead={words.replaysLead}>
      {data.length === 0 ? (
        <p>{words.noReplays}</p>
      ) : (
        <Table label={words.replays}>
          <thead>
            <tr>
              {[words.name, words.algorithm, words.missions, words.begun].map((head) => (
                <th key={head} scope="col">
                  {head}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {data.map((one) => (
              <tr key={one.name}>
                <th scope="row">
                  <Link href={replayPath(one.name)}>{one.name}</Link>
                </th>
                <td>{one.algorithm}</td>
                <td>{words.progress(whole(one.done), whole(one.missions))}</td>
                <td>
                  <Moment at={one.created_at} />
                </td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
      <Begin />
    </Panel>
  );
}

function Begin() {
  const queries = useQueryClient();
  const [, go] = useLocation();
  const [name, setName] = useState("");
  const [setting, setSetting] = useState(CODES_OWN);
  const [since, setSince] = useState("");
  const begin = useMutation({
    mutationFn: () => {
      const from = since ? { since: `${since}T00:00:00Z` } : {};
      return answered(
        api.POST("/api/v1/fleet/replays", { body: { name, ...settingOf(setting), robots: [], ...from } }),
      );
    },
    onSuccess: async (made) => {
      await queries.invalidateQueries({ queryKey: replaysQuery.queryKey });
      go(replayPath(made.name));
    },
  });
  return (
    <form
      className={classes.form}
      aria-label={words.replay}
      onSubmit={(event) => {
        event.preventDefault();
        begin.mutate();
      }}
    >
      <label className={classes.select}>
        {words.name}
        <input
          required
          pattern="[A-Za-z0-9][A-Za-z0-9._\-]{0,63}"
          value={name}
          onChange={({ currentTarget: { value } }) => setName(value)}
        />
      </label>
      <SettingFields setting={setting} change={setSetting} />
      <label className={classes.date}>
        {words.since}
        <input type="date" value={since} onChange={({ currentTarget: { value } }) => setSince(value)} />
      </label>
      <Button type="submit" variant="default" size="md" disabled={!isUsable(setting)} loading={begin.isPending}>
        {words.replay}
      </Button>
      {begin.isError && <p role="alert">{begin.error.message}</p>}
    </form>
  );
}
