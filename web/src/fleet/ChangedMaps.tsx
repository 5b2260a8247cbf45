import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { answered, api, type Schemas } from "../api/client";
import classes from "./Fleet.module.css";
import { Panel, Table } from "./Panel";
import { changedMapsQuery, type Report, rolloutsKey } from "./rollouts";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;

type Reverted = Schemas["RevertedMaps"];

interface Which {
  readonly robot?: string;
  readonly map?: string;
}

/** Maps that the candidate changed, and the way back. */
export function ChangedMaps({ of }: { readonly of: Report }) {
  const queries = useQueryClient();
  const { data } = useQuery(changedMapsQuery(of.name));
  const revert = useMutation({
    mutationFn: async (query: Which) => {
      const all: Reverted = { reverted: [], kept: [], next: null };
      do {
        const params = { path: { rollout: of.name }, query: { ...query, ...(all.next && { cursor: all.next }) } };
        const some = await answered(api.POST("/api/v1/fleet/rollouts/{rollout}/revert", { params }));
        all.reverted.push(...some.reverted);
        all.kept.push(...some.kept);
        all.next = some.next;
      } while (all.next !== null);
      return all;
    },
    onSettled: () => queries.invalidateQueries({ queryKey: rolloutsKey }),
  });
  const may = of.state !== "running" && !of.in_force;
  const left = data?.some(({ state }) => state === "to_revert") ?? false;
  return (
    <Panel
      title={words.maps}
      lead={may ? words.mapsLead : words.revertLater}
      tools={
        may &&
        left && (
          <Button variant="default" size="md" loading={revert.isPending} onClick={() => revert.mutate({})}>
            {words.revertAll}
          </Button>
        )
      }
    >
      {data?.length === 0 && <p>{words.noMaps}</p>}
      {data && data.length > 0 && (
        <Table label={words.maps}>
          <thead>
            <tr>
              {[words.map, words.versions, fleetTexts.inspect.state].map((head) => (
                <th key={head} scope="col">
                  {head}
                </th>
              ))}
              <td />
            </tr>
          </thead>
          <tbody>
            {data.map((one) => (
              <tr key={`${one.robot}/${one.map}`}>
                <th scope="row">
                  {one.robot} / {one.map}
                </th>
                <td>{one.back_to === null ? `v${one.version}` : words.versionsOf(one.back_to, one.version)}</td>
                <td>{words.mapState[one.state]}</td>
                <td>
                  {may && one.state === "to_revert" && (
                    <button
                      type="button"
                      className={classes.plain}
                      disabled={revert.isPending}
                      aria-label={`${words.revertOne}: ${one.robot} / ${one.map}`}
                      onClick={() => revert.mutate({ robot: one.robot, map: one.map })}
                    >
                      {words.revertOne}
                    </button>
                  )}
                </td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
      <div aria-live="polite">
        {revert.data && (
          <p>
            {words.reverted(
              revert.data.reverted.length,
              revert.data.reverted.reduce((sum, one) => sum + one.kept, 0),
            )}
          </p>
        )}
        {revert.data?.kept.map((one) => (
          <p key={`${one.robot}/${one.map}`}>{words.kept(`${one.robot} / ${one.map}`, one.reason)}</p>
        ))}
        {revert.isError && <p role="alert">{revert.error.message}</p>}
      </div>
    </Panel>
  );
}
