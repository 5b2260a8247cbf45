import { Button } from "@mantine/core";
import { useId, useRef, useState } from "react";
import { Icon } from "../icons";
import type { MapDocument } from "../map/document";
import classes from "./SensitivityPanel.module.css";
import { hasDrawn, RANGE, roomsOf } from "./sensitivity";
import { editorTexts } from "./texts";
import type { Sensitivity } from "./useSensitivity";

const { sensitivity: words } = editorTexts;

interface SensitivityPanelProps {
  readonly sensitivity: Sensitivity;
  /** The map as it is, whatever is tried. */
  readonly document: MapDocument;
  /** Nobody has changed the map yet: now is the time to say how finely it is to be parted. */
  readonly isNew: boolean;
}

/** One slider between fewer and more rooms, with what it comes to shown on the map. */
export function SensitivityPanel({ sensitivity, document, isNew }: SensitivityPanelProps) {
  const { value, isTrying, difference, isCurrent, blocked } = sensitivity;
  const [wanted, setWanted] = useState<boolean | null>(null);
  const ids = useId();
  const slider = useRef<HTMLInputElement>(null);
  const isOpen = isTrying || (wanted ?? isNew);

  const toggle = () => {
    sensitivity.leave();
    setWanted(!isOpen);
  };
  // The buttons go with what was tried; the focus must not get lost with them.
  const leave = () => {
    slider.current?.focus();
    sensitivity.leave();
  };
  const take = () => {
    setWanted(true);
    slider.current?.focus();
    void sensitivity.take();
  };

  const level = isTrying ? words.levels[(value - RANGE.min) / RANGE.step] : words.atRest;
  return (
    <section className={classes.card} data-open={isOpen} aria-label={words.title}>
      <h2>
        <button type="button" aria-expanded={isOpen} onClick={toggle}>
          <Icon name={isOpen ? "minus" : "plus"} size={16} />
          {words.title}
        </button>
      </h2>
      {isOpen && (
        <div className={classes.body}>
          <label className="visually-hidden" htmlFor={`${ids}-slider`}>
            {words.slider}
          </label>
          <input
            ref={slider}
            id={`${ids}-slider`}
            type="range"
            {...RANGE}
            value={value}
            aria-valuetext={level}
            aria-disabled={blocked}
            {...(isNew && { "aria-describedby": `${ids}-lead` })}
            onChange={({ currentTarget }) => !blocked && sensitivity.move(currentTarget.valueAsNumber)}
          />
          <div className={classes.ends} aria-hidden="true">
            <span>{words.fewer}</span>
            <span className={classes.level}>{level}</span>
            <span>{words.more}</span>
          </div>
          <div role="status" aria-busy={isTrying && !isCurrent}>
            <p className={classes.said}>{blocked ? words.blocked : saying(sensitivity, document)}</p>
            {difference && difference.lost.length > 0 && <p>{words.lost(difference.lost)}</p>}
          </div>
          {isTrying && (
            <div className={classes.actions}>
              <Button mih={44} disabled={!isCurrent || !sensitivity.changes} onClick={take}>
                {words.take}
              </Button>
              <Button mih={44} variant="default" onClick={leave}>
                {words.leave}
              </Button>
            </div>
          )}
          {isNew && <p id={`${ids}-lead`}>{words.lead}</p>}
          {hasDrawn(document) && <p>{words.drawn}</p>}
        </div>
      )}
    </section>
  );
}

/** The same over the map, for eyes that are on it; null: nothing is tried. */
export function hintOf(sensitivity: Sensitivity, document: MapDocument): string | null {
  return sensitivity.isTrying ? `${saying(sensitivity, document)} ${words.trying}` : null;
}

function saying({ isTrying, failed, difference, changes }: Sensitivity, document: MapDocument): string {
  if (!isTrying) return words.now(roomsOf(document).length);
  if (failed) return words.failed;
  if (!difference) return words.busy;
  const { before, after } = difference;
  if (!changes) return words.same(after);
  return before === after ? words.otherwise(after) : words.instead(after, before);
}
