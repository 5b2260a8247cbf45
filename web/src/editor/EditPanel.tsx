import { Button } from "@mantine/core";
import type { ReactNode } from "react";
import { Icon } from "../icons";
import { type Mission, onRobotSince } from "../map/history";
import * as edits from "../map/operations";
import type { MapView } from "../map/view";
import { area } from "../texts";
import classes from "./Editor.module.css";
import { DividerForm, RoomForm, ZoneForm } from "./forms";
import type { Editing, EditSession } from "./session";
import type { Selection, ShapeChange } from "./targets";
import { editorTexts } from "./texts";

export interface EditPanelProps {
  readonly state: Editing;
  readonly session: EditSession;
  readonly view: MapView;
  readonly selection: Selection;
  readonly onSelect: (selection: Selection) => void;
  readonly refOf: (id: string) => edits.Ref;
  readonly onMove: (what: NonNullable<Selection>, change: ShapeChange) => void;
  readonly onRemove: (what: NonNullable<Selection>) => void;
  readonly onDivider: (line: edits.Line) => void;
  readonly missions: readonly Mission[];
  readonly onSheet: () => void;
  /** Another division into rooms is being looked at, of which nothing can be changed yet. */
  readonly isTrying: boolean;
}

/** Everything that the map shows and can do, as lists and forms: complete without seeing or pointing at the map. */
export function EditPanel(props: EditPanelProps) {
  const { state, session, onSheet } = props;
  return (
    <div className={classes.panel}>
      <Standing state={state} missions={props.missions} />
      {state.refusal && (
        <div className={classes.refusal} role="alert">
          <p>{state.refusal.text}</p>
          <div className={classes.actions}>
            {state.refusal.offers.map((offer) => (
              <Button key={offer.title} mih={44} onClick={() => void session.attempt(() => offer.take)}>
                {editorTexts.fixes[offer.title] ?? offer.title}
              </Button>
            ))}
            <Button mih={44} variant="default" onClick={session.dismiss}>
              {editorTexts.close}
            </Button>
          </div>
        </div>
      )}
      {state.clash && (
        <div className={classes.refusal} role="alert">
          <h2>{editorTexts.clash.title}</h2>
          <ul>
            {state.clash.merge_conflicts.map((conflict) => (
              <li key={conflict.pointer}>{conflict.detail}</li>
            ))}
          </ul>
          <p>{editorTexts.clash.text}</p>
          <div className={classes.actions}>
            <Button mih={44} onClick={() => void session.resolve("theirs")}>
              {editorTexts.clash.theirs}
            </Button>
            {state.clash.merge_conflicts.some(({ operation }) => operation) && (
              <Button mih={44} variant="default" onClick={() => void session.resolve("mine")}>
                {editorTexts.clash.mine}
              </Button>
            )}
          </div>
        </div>
      )}
      {state.problems.length > 0 && <Problems {...props} />}
      {!props.isTrying && <Lists {...props} />}
      <Button className={classes.keys ?? ""} mih={44} variant="subtle" color="gray" c="inherit" onClick={onSheet}>
        {editorTexts.keys} <kbd>?</kbd>
      </Button>
    </div>
  );
}

function Lists(props: EditPanelProps) {
  const { session, view } = props;
  const keyOf = ({ id }: { readonly id: string }) => props.state.keys.get(id) ?? id;
  return (
    <>
      <Section title={editorTexts.lists.rooms}>
        {view.rooms.map((room) => (
          <Item
            key={keyOf(room)}
            of={{ sort: "room", id: room.id }}
            name={room.name}
            aside={area(room.area)}
            {...props}
          >
            <RoomForm room={room} {...props} />
          </Item>
        ))}
      </Section>
      <Section title={editorTexts.lists.dividers} none={editorTexts.none.dividers}>
        {view.dividers.map((divider) => (
          <Item
            key={keyOf(divider)}
            of={{ sort: "divider", id: divider.id }}
            name={editorTexts.divider.between(namesOf(view, divider.properties.rooms))}
            aside={editorTexts.divider[divider.properties.kind]}
            {...props}
          >
            <DividerForm divider={divider} {...props} />
          </Item>
        ))}
      </Section>
      {view.metaDividers.length > 0 && (
        <Section title={editorTexts.lists.repairs}>
          {view.metaDividers.map((repair) => (
            <Item
              key={keyOf(repair)}
              of={{ sort: "meta_divider", id: repair.id }}
              name={editorTexts.divider.between(namesOf(view, repair.properties.rooms))}
              {...props}
            >
              <Button mih={44} onClick={() => void session.attempt((o) => edits.acceptRepair(o, repair.id))}>
                {editorTexts.divider.accept}
              </Button>
            </Item>
          ))}
        </Section>
      )}
      <Section title={editorTexts.lists.zones} none={editorTexts.none.zones}>
        {view.restrictions.map((zone) => (
          <Item
            key={keyOf(zone)}
            of={{ sort: "restriction", id: zone.id }}
            name={editorTexts.zone[zone.properties.kind]}
            aside={zone.properties.placement === "unplaced" ? editorTexts.zone.unplaced : zone.id}
            {...props}
          >
            <ZoneForm zone={zone} {...props} />
          </Item>
        ))}
      </Section>
      {view.phantoms.length > 0 && (
        <Section title={editorTexts.lists.phantoms}>
          {view.phantoms.map((phantom) => (
            <Item
              key={keyOf(phantom)}
              of={{ sort: "phantom", id: phantom.id }}
              name={editorTexts.phantom}
              aside={phantom.id}
              {...props}
            >
              <Button mih={44} variant="default" onClick={() => props.onRemove({ sort: "phantom", id: phantom.id })}>
                {editorTexts.divider.remove}
              </Button>
            </Item>
          ))}
        </Section>
      )}
    </>
  );
}

function Standing({ state, missions }: { readonly state: Editing; readonly missions: readonly Mission[] }) {
  const { standing, reachable, draft, lastSaved } = state;
  const since = lastSaved === null ? null : onRobotSince(lastSaved, missions);
  return (
    <div className={classes.standing} role="status" data-standing={standing}>
      <p>
        {standing === "unsaved"
          ? editorTexts.standing.unsaved(draft.present.operations.length)
          : editorTexts.standing[standing]}
        {!reachable && standing !== "waiting" && ` ${editorTexts.standing.offline}`}
      </p>
      {lastSaved !== null && (
        <p>
          {editorTexts.saved(lastSaved)} {since === null ? editorTexts.notOnRobot : editorTexts.onRobot(since)}
        </p>
      )}
    </div>
  );
}

function Problems({ state, session, onSelect }: EditPanelProps) {
  const select = (id: string) => {
    const sort = state.document.features.find((one) => one.id === id)?.properties.semantic;
    if (sort === "room" || sort === "divider" || sort === "restriction" || sort === "phantom") onSelect({ sort, id });
  };
  const nameOf = (id: string | null) => {
    const found = state.document.features.find((one) => one.id === id)?.properties;
    return found?.semantic === "room" ? found.name : "";
  };
  return (
    <section className={classes.problems} aria-label={editorTexts.problems}>
      <h2>{editorTexts.problems}</h2>
      <ul>
        {state.problems.map(({ code, feature, message, fix_operation }) => (
          <li key={`${code} ${feature}`}>
            <button type="button" onClick={() => feature && select(feature)}>
              {editorTexts.problem[code]?.(nameOf(feature)) ?? message}
            </button>
            {fix_operation && (
              <Button
                mih={36}
                variant="default"
                onClick={() => void session.attempt((o) => [...o, fix_operation as edits.Operation])}
              >
                {editorTexts.divider.remove}
              </Button>
            )}
          </li>
        ))}
      </ul>
    </section>
  );
}

interface SectionProps {
  readonly title: string;
  readonly none?: string;
  readonly children: readonly ReactNode[];
}

function Section({ title, none, children }: SectionProps) {
  return (
    <section className={classes.section} aria-label={title}>
      <h2>{title}</h2>
      {children.length === 0 && none ? <p className={classes.none}>{none}</p> : <ul>{children}</ul>}
    </section>
  );
}

interface ItemProps extends EditPanelProps {
  readonly of: NonNullable<Selection>;
  readonly name: string;
  readonly aside?: string;
  readonly children: ReactNode;
}

function Item({ of, name, aside, selection, onSelect, children }: ItemProps) {
  const isOpen = selection?.id === of.id;
  return (
    <li className={classes.item} data-open={isOpen}>
      <button type="button" aria-expanded={isOpen} onClick={() => onSelect(isOpen ? null : of)}>
        <Icon name={isOpen ? "minus" : "plus"} size={16} />
        <span className={classes.name}>{name}</span>
        {aside && <span className={classes.aside}>{aside}</span>}
      </button>
      {isOpen && <div className={classes.form}>{children}</div>}
    </li>
  );
}

const namesOf = (view: MapView, rooms: readonly string[]): string[] =>
  rooms.flatMap((id) => view.rooms.find((room) => room.id === id)?.name ?? []);
