import { Link } from "wouter";
import { Moment } from "../Moment";
import { said } from "./figures";
import { Table } from "./Panel";
import { missionPath } from "./paths";
import type { Mission } from "./queries";
import { fleetTexts } from "./texts";

/** Missions, each a link to what is known of it. */
export function MissionTable({ label, missions }: { readonly label: string; readonly missions: readonly Mission[] }) {
  const { missions: words } = fleetTexts;
  return (
    <Table label={label}>
      <thead>
        <tr>
          {[words.mission, words.outcome, words.finished, words.firmware, words.model, words.algorithm].map((head) => (
            <th key={head} scope="col">
              {head}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {missions.map(({ robot, map, mission, ...one }) => (
          <tr key={`${robot}/${map}/${mission}`}>
            <th scope="row">
              <Link href={missionPath(robot, map, mission)}>{words.name(mission, robot)}</Link>
            </th>
            <td>
              {fleetTexts.outcome[one.outcome] ?? one.outcome}
              {one.escaped_at && ` (${words.escaped})`}
            </td>
            <td>
              <Moment at={one.finished_at} />
            </td>
            <td>{said(one.firmware)}</td>
            <td>{said(one.model)}</td>
            <td>{said(one.algorithm)}</td>
          </tr>
        ))}
      </tbody>
    </Table>
  );
}
