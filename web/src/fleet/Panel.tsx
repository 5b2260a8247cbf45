import { type ReactNode, useId } from "react";
import classes from "./Fleet.module.css";
import { fleetTexts } from "./texts";

interface Props {
  readonly title: string;
  readonly lead?: string;
  readonly tools?: ReactNode;
  readonly wide?: boolean;
  readonly children: ReactNode;
}

/** A part of a page, with a heading. */
export function Panel({ title, lead, tools, wide = false, children }: Props) {
  const id = useId();
  return (
    <section className={classes.panel} data-wide={wide} aria-labelledby={id}>
      <div className={classes.panelHead}>
        <h2 id={id}>{title}</h2>
        {tools}
      </div>
      {lead && <p className={classes.lead}>{lead}</p>}
      {children}
    </section>
  );
}

/** A chart's other half: what it shows as a table. */
export function TableSwitch({ on, onChange }: { readonly on: boolean; readonly onChange: (on: boolean) => void }) {
  return (
    <button type="button" className={classes.plain} onClick={() => onChange(!on)}>
      {on ? fleetTexts.chart.asChart : fleetTexts.chart.asTable}
    </button>
  );
}

/** A table that scrolls sideways inside its own place, where it is too wide. */
export function Table({ label, children }: { readonly label: string; readonly children: ReactNode }) {
  return (
    // biome-ignore lint/a11y/useSemanticElements lint/a11y/noNoninteractiveTabindex: what scrolls takes the focus
    <div className={classes.scroll} role="group" aria-label={label} tabIndex={0}>
      <table className={classes.table}>{children}</table>
    </div>
  );
}
