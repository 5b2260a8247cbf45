import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { Link } from "wouter";
import { api, type Schemas } from "../api/client";
import { Moment } from "../Moment";
import { Failure, Loading } from "../pages/states";
import { texts } from "../texts";
import { AlertsPanel } from "./AlertsPanel";
import classes from "./Fleet.module.css";
import { Panel, Table } from "./Panel";
import { missionPath } from "./paths";
import { unprocessedKey, unprocessedQuery } from "./rollouts";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;

/** What went wrong in the service itself, and when to be told. */
export function OperationsPage() {
  const found = useQuery(unprocessedQuery);
  if (found.isError && !found.data)
    return <Failure what={fleetTexts.failed} error={found.error} retry={() => void found.refetch()} />;
  return (
    <>
      <title>{`${words.operations} · ${texts.product}`}</title>
      <h1>{words.operations}</h1>
      <Panel title={words.unprocessed} lead={words.unprocessedLead}>
        {!found.data && <Loading />}
        {found.data?.length === 0 && <p>{words.noUnprocessed}</p>}
        {found.data && found.data.length > 0 && <Unprocessed missions={found.data} />}
      </Panel>
      <AlertsPanel />
    </>
  );
}

type Mission = Schemas["UnprocessedMission"];

function Unprocessed({ missions }: { readonly missions: readonly Mission[] }) {
  return (
    <Table label={words.unprocessed}>
      <thead>
        <tr>
          {[fleetTexts.missions.mission, fleetTexts.missions.finished, fleetTexts.inspect.attempts, words.error].map(
            (head) => (
              <th key={head} scope="col">
                {head}
              </th>
            ),
          )}
          <td />
        </tr>
      </thead>
      <tbody>
        {missions.map((one) => (
          <Row key={one.url} of={one} />
        ))}
      </tbody>
    </Table>
  );
}

function Row({ of: { robot, map, mission, finished_at, attempts, error } }: { readonly of: Mission }) {
  const queries = useQueryClient();
  const run = useMutation({
    mutationFn: async () => {
      const params = { path: { robot, map, mission } };
      const path = "/api/v1/fleet/robots/{robot}/maps/{map}/missions/{mission}/run";
      const { response, error: problem } = await api.POST(path, { params });
      if (!response.ok) throw new Error(detail(problem));
    },
    onSettled: () => queries.invalidateQueries({ queryKey: unprocessedKey }),
  });
  const name = fleetTexts.missions.name(mission, robot);
  return (
    <tr>
      <th scope="row">
        <Link href={missionPath(robot, map, mission)}>{name}</Link>
      </th>
      <td>{finished_at && <Moment at={finished_at} />}</td>
      <td>{attempts}</td>
      <td>
        <code>{error.trim().split("\n").at(-1)}</code>
      </td>
      <td>
        <button
          type="button"
          className={classes.plain}
          disabled={run.isPending || run.isSuccess}
          aria-label={`${words.runAgain}: ${name}`}
          onClick={() => run.mutate()}
        >
          {run.isSuccess ? words.queued : words.runAgain}
        </button>
        {run.isError && <span role="alert">{run.error.message}</span>}
      </td>
    </tr>
  );
}

function detail(problem: unknown): string {
  const said = typeof problem === "object" && problem !== null && "detail" in problem ? problem.detail : null;
  return typeof said === "string" ? said : words.notDone;
}
