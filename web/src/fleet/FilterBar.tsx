import { useQuery } from "@tanstack/react-query";
import { useEffect, useRef } from "react";
import own from "./FilterBar.module.css";
import classes from "./Fleet.module.css";
import { day, said } from "./figures";
import { dayOf, type Filters, SPANS, spanOf, VALUES, type Value } from "./filters";
import { knownQuery } from "./queries";
import { fleetTexts } from "./texts";

interface Props {
  readonly filters: Filters;
  readonly change: (changed: Partial<Filters>) => void;
}

/** Which missions a page is about. */
export function FilterBar({ filters, change }: Props) {
  const known = useQuery(knownQuery);
  const texts = fleetTexts.filter;
  const now = new Date();
  const span = spanOf(filters, now);
  const selected = VALUES.some((name) => filters[name].length > 0);
  return (
    <search className={own.filters} aria-label={texts.label}>
      <fieldset className={own.spans}>
        <legend className="visually-hidden">{texts.span}</legend>
        {SPANS.map((days) => (
          <label key={days} data-on={filters.days === days}>
            <input
              type="radio"
              name="span"
              className="visually-hidden"
              checked={filters.days === days}
              onChange={() => change({ days, from: null, to: null })}
            />
            {texts.days[days]}
          </label>
        ))}
      </fieldset>
      <Menu
        label={filters.days === null ? `${day(span.from)} – ${day(span.to)}` : texts.dates}
        on={filters.days === null}
      >
        {(["from", "to"] as const).map((end) => (
          <label key={end} className={classes.date}>
            {texts[end]}
            <input
              type="date"
              value={span[end]}
              max={dayOf(now)}
              onChange={({ currentTarget: { value } }) => value && change({ days: null, ...span, [end]: value })}
            />
          </label>
        ))}
      </Menu>
      {VALUES.map((name) => (
        <Values key={name} name={name} known={known.data?.[name] ?? []} filters={filters} change={change} />
      ))}
      {selected && (
        <button
          type="button"
          className={classes.plain}
          onClick={() => change({ firmware: [], model: [], algorithm: [], size: [] })}
        >
          {texts.clear}
        </button>
      )}
    </search>
  );
}

interface ValuesProps extends Props {
  readonly name: Value;
  readonly known: readonly string[];
}

function Values({ name, known, filters, change }: ValuesProps) {
  const texts = fleetTexts.filter;
  const chosen: readonly string[] = filters[name];
  // One that is asked for in the address is shown also where no mission has it.
  const all = [...known, ...chosen.filter((one) => !known.includes(one))];
  const [first] = chosen;
  const stands = first === undefined ? texts.all : chosen.length === 1 ? said(first) : texts.some(chosen.length);
  const toggle = (value: string) =>
    change({ [name]: chosen.includes(value) ? chosen.filter((one) => one !== value) : [...chosen, value] });
  return (
    <Menu label={`${texts[name]}: ${stands}`} on={chosen.length > 0}>
      {all.length === 0 && <p>{texts.none}</p>}
      {all.map((value) => (
        <label key={value} className={classes.check}>
          <input type="checkbox" checked={chosen.includes(value)} onChange={() => toggle(value)} />
          {said(value)}
        </label>
      ))}
    </Menu>
  );
}

interface MenuProps {
  readonly label: string;
  readonly on: boolean;
  readonly children: React.ReactNode;
}

/** Opens below its label; closes when one goes elsewhere. */
function Menu({ label, on, children }: MenuProps) {
  const menu = useRef<HTMLDetailsElement>(null);
  useEffect(() => {
    const close = (event: Event) => {
      const { current } = menu;
      if (!current?.open) return;
      const escaped = event instanceof KeyboardEvent && event.key === "Escape";
      if (escaped) current.querySelector("summary")?.focus();
      if (escaped || (event.type !== "keydown" && !current.contains(event.target as Node))) current.open = false;
    };
    for (const type of ["pointerdown", "focusin", "keydown"]) document.addEventListener(type, close);
    return () => {
      for (const type of ["pointerdown", "focusin", "keydown"]) document.removeEventListener(type, close);
    };
  }, []);
  return (
    <details ref={menu} className={own.menu}>
      <summary data-on={on}>{label}</summary>
      <div className={own.menuBody}>{children}</div>
    </details>
  );
}
