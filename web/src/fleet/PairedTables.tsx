import { whole } from "./figures";
import { Table } from "./Panel";
import type { Paired } from "./rollouts";
import { fleetTexts } from "./texts";

const words = fleetTexts.rollouts;

export const measureName = (measure: Paired["measure"]): string =>
  measure === "taken" ? words.taken : fleetTexts.measure[measure];

export const chance = (p: number): string => (p < 0.001 ? "< 0.001" : p.toPrecision(2));

/** The same missions both ways, by row of the results table. */
export function PairedTables({ tables }: { readonly tables: readonly Paired[] }) {
  return (
    <Table label={words.paired}>
      <thead>
        <tr>
          {[words.measure, words.both, words.onlyOld, words.onlyNew, words.neither, words.p].map((head) => (
            <th key={head} scope="col">
              {head}
            </th>
          ))}
        </tr>
      </thead>
      <tbody>
        {tables.map((table) => (
          <tr key={table.measure}>
            <th scope="row">{measureName(table.measure)}</th>
            <td>{whole(table.both)}</td>
            <td>{whole(table.only_old)}</td>
            <td>{whole(table.only_new)}</td>
            <td>{whole(table.neither)}</td>
            <td>{chance(table.p)}</td>
          </tr>
        ))}
      </tbody>
    </Table>
  );
}
