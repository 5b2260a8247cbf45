import { Button } from "@mantine/core";
import { type FormEvent, startTransition, useEffect, useId, useOptimistic, useState } from "react";
import type { DividerFeature, Position, RestrictionFeature } from "../map/document";
import * as edits from "../map/operations";
import { areaOf, splitRoom } from "../map/split";
import type { RoomView } from "../map/view";
import classes from "./Editor.module.css";
import type { EditPanelProps } from "./EditPanel";
import { chordAcross, grown, middle, shifted, turned } from "./targets";
import { editorTexts } from "./texts";

const NUDGE_M = 0.05;
const GROW_M = 0.1;
const TURN = (5 * Math.PI) / 180;

/** A part that the draft itself makes has no lasting id yet: it is named by a point in it. */
function roomRef(room: RoomView, { state }: EditPanelProps): edits.RoomRef {
  return state.known.has(room.id) ? { id: room.id } : { at: room.label.at };
}

/** What was chosen, shown at once: the draft has it when its turn comes, and may refuse it. */
function useChosen<Value>(
  value: Value,
  choose: (wanted: Value) => Promise<unknown>,
): readonly [Value, (wanted: Value) => void] {
  const [shown, show] = useOptimistic(value);
  const set = (wanted: Value) =>
    startTransition(async () => {
      show(wanted);
      await choose(wanted);
    });
  return [shown, set];
}

export function RoomForm(props: EditPanelProps & { readonly room: RoomView }) {
  const { room, session, view } = props;
  const ref = roomRef(room, props);
  const ids = useId();
  const [name, setName] = useState(room.name);
  useEffect(() => setName(room.name), [room.name]);
  const rename = (event?: FormEvent) => {
    event?.preventDefault();
    const clean = name.trim();
    if (clean && clean !== room.name) void session.attempt((o) => edits.renameRoom(o, ref, clean));
    else setName(room.name);
  };
  const [kind, setKind] = useChosen(room.kind, (wanted) => session.attempt((o) => edits.setRoomKind(o, ref, wanted)));
  const [pinned, pin] = useChosen(room.pinned, (wanted) => session.attempt((o) => edits.pinRoom(o, ref, wanted)));
  const outline = room.rings[0]?.slice(0, -1) ?? [];
  return (
    <>
      <form className={classes.row} onSubmit={rename}>
        <label htmlFor={`${ids}-name`}>{editorTexts.room.name}</label>
        <input
          id={`${ids}-name`}
          value={name}
          maxLength={64}
          autoComplete="off"
          onChange={(event) => setName(event.currentTarget.value)}
          onBlur={() => rename()}
        />
      </form>
      <div className={classes.row}>
        <label htmlFor={`${ids}-kind`}>{editorTexts.room.kind}</label>
        <select
          id={`${ids}-kind`}
          value={kind ?? ""}
          onChange={({ currentTarget: { value } }) => setKind((value || null) as edits.RoomKind | null)}
        >
          <option value="">{editorTexts.room.noKind}</option>
          {Object.entries(editorTexts.kinds).map(([one, label]) => (
            <option key={one} value={one}>
              {label}
            </option>
          ))}
        </select>
      </div>
      <label className={classes.check}>
        <input type="checkbox" checked={pinned} onChange={({ currentTarget: { checked } }) => pin(checked)} />
        {editorTexts.room.pinned}
      </label>
      <SplitForm room={room} onDivider={props.onDivider} />
      {"id" in ref && room.neighbours.length > 0 && (
        <fieldset className={classes.group}>
          <legend>{editorTexts.room.merge}</legend>
          {room.neighbours
            .filter((other) => view.rooms.some(({ id }) => id === other.id))
            .map((other) => (
              <Button
                key={other.id}
                mih={44}
                variant="default"
                onClick={() => void session.attempt((o) => edits.mergeRooms(o, [room.id, other.id]))}
              >
                {other.name}
              </Button>
            ))}
        </fieldset>
      )}
      <Button mih={44} variant="default" onClick={() => void session.attempt((o) => edits.markPhantom(o, outline))}>
        {editorTexts.room.phantom}
      </Button>
    </>
  );
}

/** Divides a room without pointing at it: a line, upright or level, at a place that is said in words and areas. */
export function SplitForm({ room, onDivider }: Pick<EditPanelProps, "onDivider"> & { readonly room: RoomView }) {
  const ids = useId();
  const [direction, setDirection] = useState<"upright" | "level">("upright");
  const [share, setShare] = useState(50);
  const line = chordAcross(room.rings, direction, share / 100);
  const parts = line ? splitRoom(room.rings, line) : [];
  return (
    <fieldset className={classes.group}>
      <legend>{editorTexts.room.split}</legend>
      <div className={classes.row}>
        <label htmlFor={`${ids}-direction`}>{editorTexts.room.direction}</label>
        <select
          id={`${ids}-direction`}
          value={direction}
          onChange={({ currentTarget: { value } }) => setDirection(value === "level" ? "level" : "upright")}
        >
          <option value="upright">{editorTexts.room.upright}</option>
          <option value="level">{editorTexts.room.level}</option>
        </select>
      </div>
      <div className={classes.row}>
        <label htmlFor={`${ids}-share`}>{editorTexts.room.position}</label>
        <input
          id={`${ids}-share`}
          type="range"
          min={5}
          max={95}
          value={share}
          aria-valuetext={parts.length > 1 ? editorTexts.room.parts(parts.map(areaOf)) : editorTexts.room.noLine}
          onChange={({ currentTarget }) => setShare(currentTarget.valueAsNumber)}
        />
      </div>
      <p className={classes.none}>
        {parts.length > 1 ? editorTexts.room.parts(parts.map(areaOf)) : editorTexts.room.noLine}
      </p>
      <Button mih={44} variant="default" disabled={parts.length < 2} onClick={() => line && onDivider(line)}>
        {editorTexts.room.divide}
      </Button>
    </fieldset>
  );
}

export function DividerForm(props: EditPanelProps & { readonly divider: DividerFeature }) {
  const { divider, session, refOf, onMove, onRemove } = props;
  const what = { sort: "divider", id: divider.id } as const;
  const kind = divider.properties.kind;
  return (
    <>
      <fieldset className={classes.group}>
        <legend>{editorTexts.divider.kind}</legend>
        {(["open", "door"] as const).map((one) => (
          <Button
            key={one}
            mih={44}
            variant={kind === one ? "filled" : "default"}
            aria-pressed={kind === one}
            onClick={() => void session.attempt((o) => edits.setDividerKind(o, refOf(divider.id), one))}
          >
            {editorTexts.divider[one]}
          </Button>
        ))}
      </fieldset>
      <Nudges onMove={(step) => onMove(what, (shape) => shifted(shape, step))} />
      <fieldset className={classes.group}>
        <legend>{editorTexts.divider.turn}</legend>
        <Button mih={44} variant="default" onClick={() => onMove(what, (shape) => turned(shape, TURN))}>
          {editorTexts.divider.turnLeft}
        </Button>
        <Button mih={44} variant="default" onClick={() => onMove(what, (shape) => turned(shape, -TURN))}>
          {editorTexts.divider.turnRight}
        </Button>
      </fieldset>
      <Button mih={44} variant="default" onClick={() => onRemove(what)}>
        {editorTexts.divider.remove}
      </Button>
    </>
  );
}

export function ZoneForm(props: EditPanelProps & { readonly zone: RestrictionFeature }) {
  const { zone, onMove, onRemove } = props;
  const what = { sort: "restriction", id: zone.id } as const;
  return (
    <>
      <Nudges onMove={(step) => onMove(what, (shape) => shifted(shape, step))} />
      <fieldset className={classes.group}>
        <legend className="visually-hidden">{editorTexts.divider.larger}</legend>
        <Button mih={44} variant="default" onClick={() => onMove(what, (shape) => resized(shape, GROW_M))}>
          {editorTexts.divider.larger}
        </Button>
        <Button mih={44} variant="default" onClick={() => onMove(what, (shape) => resized(shape, -GROW_M))}>
          {editorTexts.divider.smaller}
        </Button>
        <Button mih={44} variant="default" onClick={() => onMove(what, (shape) => turned(shape, TURN))}>
          {editorTexts.divider.turnLeft}
        </Button>
      </fieldset>
      <Button mih={44} variant="default" onClick={() => onRemove(what)}>
        {editorTexts.divider.remove}
      </Button>
    </>
  );
}

/** A line grows along itself, a ring in both directions. */
function resized(shape: readonly Position[], metres: number): readonly Position[] {
  if (shape.length > 2) return grown(shape, metres);
  const [from, to] = shape;
  if (!from || !to) return shape;
  const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
  const factor = Math.max(0.1, length + metres) / length;
  const [cx, cy] = middle(shape);
  return shape.map(([x, y]) => [cx + (x - cx) * factor, cy + (y - cy) * factor]);
}

function Nudges({ onMove }: { readonly onMove: (step: Position) => void }) {
  const { left, right, up, down } = editorTexts.divider;
  const steps: readonly (readonly [string, Position])[] = [
    [left, [-NUDGE_M, 0]],
    [right, [NUDGE_M, 0]],
    [up, [0, NUDGE_M]],
    [down, [0, -NUDGE_M]],
  ];
  return (
    <fieldset className={classes.group}>
      <legend>{editorTexts.divider.move}</legend>
      {steps.map(([label, step]) => (
        <Button key={label} mih={44} variant="default" onClick={() => onMove(step)}>
          {label}
        </Button>
      ))}
    </fieldset>
  );
}
