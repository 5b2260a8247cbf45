import { useQuery } from "@tanstack/react-query";
import { useId, useState } from "react";
import classes from "./Fleet.module.css";
import { axisEnd, said, whole } from "./figures";
import { type Filters, VALUES, type Value } from "./filters";
import { LineSample, LOOKS, ROWS } from "./marks";
import { Panel, Table } from "./Panel";
import { ratesQuery } from "./queries";
import { Share } from "./RatesPanel";
import { fleetTexts } from "./texts";
import { Whiskers } from "./Whiskers";

interface Props {
  readonly filters: Filters;
  readonly change: (changed: Partial<Filters>) => void;
}

/** The three rates by firmware, model, algorithm or size of home: chart and table in one. */
export function GroupsPanel({ filters, change }: Props) {
  const [by, setBy] = useState<Value>("firmware");
  const id = useId();
  const { data } = useQuery(ratesQuery(filters, by));
  const end = axisEnd((data?.items ?? []).filter((row) => row.sufficient).map((row) => row.ci95.transfer[1]));
  const { groups: texts } = fleetTexts;
  return (
    <Panel
      wide
      title={texts.title}
      lead={texts.lead}
      tools={
        <label className={classes.select} htmlFor={id}>
          {texts.by}
          <select id={id} value={by} onChange={({ currentTarget: { value } }) => setBy(value as Value)}>
            {VALUES.map((name) => (
              <option key={name} value={name}>
                {fleetTexts.filter[name]}
              </option>
            ))}
          </select>
        </label>
      }
    >
      {data?.items.length === 0 && <p>{fleetTexts.chart.empty}</p>}
      {data && data.items.length > 0 && (
        <Table label={texts.label(fleetTexts.filter[by])}>
          <thead>
            <tr>
              <th scope="col">{fleetTexts.filter[by]}</th>
              <th scope="col">{fleetTexts.chart.nHead}</th>
              <th scope="col">{fleetTexts.chart.robotsHead}</th>
              <td aria-hidden="true" />
              {ROWS.map((name) => (
                <th key={name} scope="col">
                  <LineSample row={name} /> {fleetTexts.measure[name]}
                </th>
              ))}
            </tr>
          </thead>
          <tbody>
            {data.items.map((row) => (
              <tr key={row.key}>
                <th scope="row">
                  <button type="button" className={classes.plain} onClick={() => change({ [by]: [row.key] })}>
                    {said(row.key)}
                  </button>
                </th>
                <td>{whole(row.missions)}</td>
                <td>{whole(row.robots)}</td>
                <td className={classes.plot}>
                  <Whiskers
                    end={end}
                    marks={ROWS.map((name) => ({
                      interval: row.ci95[name],
                      point: row.sufficient ? row.rates[name] : null,
                      colour: LOOKS[name].colour,
                      shape: LOOKS[name].shape,
                    }))}
                  />
                </td>
                {ROWS.map((name) => (
                  <td key={name}>
                    <Share row={row} of={name} />
                  </td>
                ))}
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </Panel>
  );
}
