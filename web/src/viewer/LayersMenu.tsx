import { Button } from "@mantine/core";
import { useClickOutside } from "@mantine/hooks";
import { useId, useState } from "react";
import { Icon } from "../icons";
import { ROOM_FILLS, type Scheme } from "../map/colours";
import { type Layer, MAP_STYLES, type Stroke } from "../map/styles";
import { texts } from "../texts";
import classes from "./LayersMenu.module.css";

export const LAYERS: readonly Layer[] = [
  "names",
  "rooms",
  "dividers",
  "walls",
  "clutter",
  "meta",
  "restrictions",
  "changed",
  "proposed",
  "grid",
];

interface LayersMenuProps {
  readonly present: readonly Layer[];
  readonly scheme: Scheme;
  readonly hidden: ReadonlySet<Layer>;
  readonly onToggle: (layer: Layer) => void;
}

/** What is drawn, and at the same time the map's legend. */
export function LayersMenu({ present, scheme, hidden, onToggle }: LayersMenuProps) {
  const [open, setOpen] = useState(false);
  const panelId = useId();
  const menu = useClickOutside<HTMLDivElement>(() => setOpen(false));
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: Escape closes the panel wherever in it the focus is
    <div ref={menu} className={classes.menu} onKeyDown={({ key }) => key === "Escape" && setOpen(false)}>
      <Button
        variant="default"
        h={44}
        leftSection={<Icon name="layers" />}
        aria-expanded={open}
        aria-controls={panelId}
        onClick={() => setOpen(!open)}
      >
        {texts.map.layers}
      </Button>
      <fieldset id={panelId} className={classes.panel} hidden={!open}>
        <legend className="visually-hidden">{texts.map.layers}</legend>
        {present.map((layer) => (
          <label key={layer} className={classes.row}>
            <input type="checkbox" checked={!hidden.has(layer)} onChange={() => onToggle(layer)} />
            <span className={classes.name}>{texts.layers[layer]}</span>
            <Key layer={layer} scheme={scheme} />
          </label>
        ))}
      </fieldset>
    </div>
  );
}

/** A sample of how the layer is drawn. */
function Key({ layer, scheme }: { readonly layer: Layer; readonly scheme: Scheme }) {
  const style = MAP_STYLES[scheme];
  const line = (stroke: Stroke) => (
    <path
      d="M3 10h30"
      fill="none"
      stroke={stroke.colour}
      strokeWidth={stroke.width}
      strokeDasharray={stroke.dash?.join(" ")}
    />
  );
  const box = (fill: string | undefined, stroke?: Stroke) => (
    <rect
      x="4"
      y="3"
      width="28"
      height="14"
      rx="3"
      fill={fill ?? "none"}
      stroke={stroke?.colour}
      strokeWidth={stroke?.width}
      strokeDasharray={stroke?.dash?.join(" ")}
    />
  );
  const samples: Record<Layer, React.ReactNode> = {
    names: (
      <text x="18" y="15" textAnchor="middle" fontSize="13" fontWeight="600" fill={style.ink}>
        Aa
      </text>
    ),
    rooms: ROOM_FILLS[scheme]
      .slice(0, 3)
      .map((fill, i) => <rect key={fill} x={3 + i * 10} y="4" width="10" height="12" fill={fill} />),
    dividers: line(style.dividerOpen),
    walls: line(style.wall),
    clutter: box(style.clutter.fill, style.clutter.stroke),
    meta: box(style.metaOccupied.fill, style.metaOccupied.stroke),
    restrictions: box(style.noGo.fill, style.noGo.stroke),
    changed: box(style.lost.fill, style.lost.stroke),
    proposed: line(style.proposed),
    grid: (
      <g fill={style.wall.colour}>
        <path d="M6 4h4v4h4v4h4V8h4v4h4v4H14v-4H6z" />
      </g>
    ),
  };
  return (
    <svg aria-hidden="true" width="36" height="20" viewBox="0 0 36 20">
      {samples[layer]}
    </svg>
  );
}
