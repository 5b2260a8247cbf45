import { useState } from "react";
import { pixelsToMap } from "../map/geometry";
import { area } from "../numbers";
import classes from "./Fleet.module.css";
import own from "./FloorPlan.module.css";
import { Table } from "./Panel";
import { extentOf, ofKind, pathOf, type Shape } from "./plan";
import type { Figure } from "./queries";
import { fleetTexts } from "./texts";

const LAYERS = ["cells", "tracked", "rooms", "differences", "meta_occupancy", "meta_divider"] as const;
type Layer = (typeof LAYERS)[number];

/** The paper's figures of one mission: what was sensed, the boundaries before over those after, differences and the meta layer. */
export function FloorPlan({ figure }: { readonly figure: Figure }) {
  const [hidden, setHidden] = useState<ReadonlySet<Layer>>(new Set());
  const { plan: words } = fleetTexts;
  const { x, y, width, height } = extentOf(figure);
  const shown = (layer: Layer) => !hidden.has(layer);
  const toggle = (layer: Layer) =>
    setHidden((before) => {
      const next = new Set(before);
      if (!next.delete(layer)) next.add(layer);
      return next;
    });
  const outcome = fleetTexts.outcome[figure.outcome] ?? figure.outcome;
  return (
    <>
      <fieldset className={own.layers}>
        <legend className="visually-hidden">{words.layers}</legend>
        {LAYERS.map((layer) => (
          <label key={layer} className={classes.check}>
            <input type="checkbox" checked={shown(layer)} onChange={() => toggle(layer)} />
            <svg width="26" height="14" aria-hidden="true" data-layer={layer} className={own.sample}>
              <path d="M1 7H25" />
            </svg>
            {words[layer]}
          </label>
        ))}
      </fieldset>
      <svg
        className={own.floorPlan}
        viewBox={`${x} ${-y - height} ${width} ${height}`}
        role="img"
        aria-label={words.label(figure.mission)}
      >
        <g transform="scale(1 -1)">
          {shown("cells") && (
            <image
              href={figure.cells}
              width={figure.frame.width}
              height={figure.frame.height}
              transform={`matrix(${pixelsToMap(figure.frame).join(" ")})`}
            />
          )}
          {shown("differences") && (
            <g data-layer="differences">
              {figure.differences.map((one) => (
                <path key={pathOf(one.geometry)} d={pathOf(one.geometry)} data-change={one.change} />
              ))}
            </g>
          )}
          {shown("meta_occupancy") && (
            <Shapes layer="meta_occupancy" shapes={ofKind(figure.candidate, "meta_occupancy")} />
          )}
          {shown("rooms") && (
            <Shapes
              layer="rooms"
              shapes={[...ofKind(figure.candidate, "room"), ...ofKind(figure.candidate, "divider")]}
            />
          )}
          {shown("tracked") && (
            <Shapes
              layer="tracked"
              shapes={[...ofKind(figure.tracked, "room"), ...ofKind(figure.tracked, "divider")]}
            />
          )}
          {shown("meta_divider") && <Shapes layer="meta_divider" shapes={ofKind(figure.candidate, "meta_divider")} />}
        </g>
      </svg>
      <p className={classes.hint}>{words.now(figure.algorithm, outcome)}</p>
      {figure.differences.length === 0 ? (
        <p>{words.noDifferences}</p>
      ) : (
        <Table label={words.differences}>
          <thead>
            <tr>
              <th scope="col">{words.kind}</th>
              <th scope="col">{words.area}</th>
            </tr>
          </thead>
          <tbody>
            {figure.differences.map((one) => (
              <tr key={pathOf(one.geometry)}>
                <th scope="row">{words.change[one.change]}</th>
                <td>{area(one.area)}</td>
              </tr>
            ))}
          </tbody>
        </Table>
      )}
    </>
  );
}

function Shapes({ layer, shapes }: { readonly layer: Layer; readonly shapes: readonly Shape[] }) {
  return (
    <g data-layer={layer}>
      {shapes.map((one) => (
        <path key={one.id ?? pathOf(one.geometry)} d={pathOf(one.geometry)} />
      ))}
    </g>
  );
}
