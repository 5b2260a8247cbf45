import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api, type Schemas } from "../api/client";
import { robotsQuery } from "../api/queries";
import { Moment } from "../Moment";
import classes from "../people/People.module.css";
import { Act, Section, Trouble } from "../people/parts";
import { Pick, Save, WholeHome, zipped } from "./Archives";
import { Retention } from "./Retention";
import { Sure } from "./Sure";
import { privacyTexts as words } from "./texts";

type Robot = Schemas["RobotSummary"];

/** What is kept of one's home: saved, brought in, deleted; who looked. */
export function PrivacySection({ email }: { readonly email: string }) {
  const robots = useQuery(robotsQuery);
  const own = robots.data?.items.filter(({ owner }) => owner === email) ?? [];
  return (
    <Section title={words.title}>
      <p>{words.lead}</p>
      <WholeHome />
      <ul className={classes.list}>
        {own.map((robot) => (
          <Kept key={robot.id} robot={robot} />
        ))}
      </ul>
      <Retention />
      <EraseHome email={email} />
    </Section>
  );
}

function Kept({ robot: { id, name } }: { readonly robot: Robot }) {
  const queries = useQueryClient();
  const [shown, setShown] = useState(false);
  const [asked, setAsked] = useState(false);
  const settle = { onSettled: () => queries.invalidateQueries() };
  const erase = useMutation({
    mutationFn: () =>
      answered(api.DELETE("/api/v1/robots/{robot}/maps", { params: { path: { robot: id }, query: { confirm: id } } })),
    onSuccess: () => setAsked(false),
    ...settle,
  });
  const bringIn = useMutation({
    mutationFn: (file: File) =>
      answered(api.POST("/api/v1/robots/{robot}/archive", { params: { path: { robot: id } }, ...zipped(file) })),
    ...settle,
  });
  return (
    <li>
      <p>
        <strong>{name}</strong>
      </p>
      <div className={classes.actions}>
        <Save href={`/api/v1/robots/${encodeURIComponent(id)}/archive`} file={`${id}.zip`} name={words.saveOf(name)}>
          {words.save}
        </Save>
        <Pick name={words.bringInOf(name)} pending={bringIn.isPending} onFile={(file) => bringIn.mutate(file)}>
          {words.bringIn}
        </Pick>
        <Button
          mih={40}
          variant="default"
          aria-expanded={shown}
          aria-label={words.logOf(name)}
          onClick={() => setShown(!shown)}
        >
          {words.log}
        </Button>
        <Act name={words.eraseOf(name)} onClick={() => setAsked(true)}>
          {words.erase}
        </Act>
      </div>
      {shown && <Log robot={id} />}
      {asked && (
        <Sure
          title={words.eraseTitle(name)}
          text={words.eraseText}
          name={id}
          pending={erase.isPending}
          yes={() => erase.mutate()}
          no={() => setAsked(false)}
        />
      )}
      {erase.data && <p role="status">{words.erased(erase.data.maps, erase.data.missions)}</p>}
      {bringIn.data && <p role="status">{words.broughtIn(bringIn.data.maps.length, bringIn.data.versions)}</p>}
      <Trouble error={erase.error ?? bringIn.error} problems={{ 409: words.clash, 422: words.unreadable }} />
    </li>
  );
}

function Log({ robot }: { readonly robot: string }) {
  const log = useQuery({
    queryKey: ["robots", robot, "log"],
    queryFn: ({ signal }) => answered(api.GET("/api/v1/robots/{robot}/log", { params: { path: { robot } }, signal })),
    refetchOnMount: "always",
  });
  if (log.error) return <Trouble error={log.error} />;
  if (!log.data) return null;
  if (log.data.items.length === 0) return <p>{words.nobody}</p>;
  return (
    <ul className={classes.list}>
      {log.data.items.map((entry) => (
        <li key={`${entry.at}${entry.who}${entry.what}`}>
          <p>
            <strong>{entry.who.replace(/^user:/, "")}</strong> {words.did[entry.did]} {thing(entry.what)}
            {words.times(entry.times)}
          </p>
          <p className={classes.soft}>
            <Moment at={entry.at} /> {entry.source && words.from(entry.source)}
          </p>
        </li>
      ))}
    </ul>
  );
}

/** In the reader's language; what the robot calls a floor stays as it is. */
function thing(what: string): string {
  const [, floor = "", called = what] = /^([^:]*: )(.*)$/.exec(what) ?? [];
  return floor + (words.things[called.split(" ")[0] ?? ""] ?? called);
}

function EraseHome({ email }: { readonly email: string }) {
  const [asked, setAsked] = useState(false);
  const erase = useMutation({
    mutationFn: () => answered(api.DELETE("/api/v1/home", { params: { query: { confirm: email } } })),
    onSuccess: () => location.assign("/"),
  });
  return (
    <>
      <h3>{words.eraseHome}</h3>
      {!asked && (
        <Act name={words.eraseHome} onClick={() => setAsked(true)}>
          {words.eraseHome}
        </Act>
      )}
      {asked && (
        <Sure
          title={words.eraseHomeTitle}
          text={words.eraseHomeText}
          name={email}
          pending={erase.isPending}
          yes={() => erase.mutate()}
          no={() => setAsked(false)}
        />
      )}
      <Trouble error={erase.error} />
    </>
  );
}
