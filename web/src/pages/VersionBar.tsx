import { ActionIcon, Button } from "@mantine/core";
import type { Schemas } from "../api/client";
import { Icon } from "../icons";
import { Moment } from "../Moment";
import { texts } from "../texts";
import classes from "./VersionBar.module.css";

interface VersionBarProps {
  readonly shown: Schemas["MapDocument"];
  readonly newest: number;
  /** Versions that can be stepped through, rising. */
  readonly numbers: readonly number[];
  readonly onChoose: (version: number | null) => void;
}

/** Which version the map shows; steps through the others. */
export function VersionBar({ shown, newest, numbers, onChoose }: VersionBarProps) {
  const choose = (version: number) => onChoose(version === newest ? null : version);
  const at = numbers.indexOf(shown.version);
  const [before, after] = [at > 0 ? numbers[at - 1] : undefined, at >= 0 ? numbers[at + 1] : undefined];
  const isOld = shown.version !== newest;
  return (
    <section className={classes.bar} data-old={isOld} aria-label={texts.history.step}>
      {numbers.length > 1 && <Step icon="left" label={texts.history.previous} to={before} onChoose={choose} />}
      <div className={classes.middle}>
        <p className={classes.position}>
          <strong>{texts.history.position(shown.version, newest)}</strong>{" "}
          <span>
            {texts.history.cause[shown.cause]} <Moment at={shown.created_at} />
          </span>
        </p>
        {numbers.length > 1 && (
          <input
            type="range"
            aria-label={texts.history.step}
            aria-valuetext={texts.history.position(shown.version, newest)}
            min={0}
            max={numbers.length - 1}
            value={Math.max(0, at)}
            onChange={(event) => {
              const version = numbers[event.currentTarget.valueAsNumber];
              if (version !== undefined) choose(version);
            }}
          />
        )}
      </div>
      {numbers.length > 1 && <Step icon="right" label={texts.history.next} to={after} onChoose={choose} />}
      {isOld && (
        <Button className={classes.newest ?? ""} h={44} onClick={() => onChoose(null)}>
          {texts.history.newest}
        </Button>
      )}
    </section>
  );
}

interface StepProps {
  readonly icon: "left" | "right";
  readonly label: string;
  readonly to: number | undefined;
  readonly onChoose: (version: number) => void;
}

function Step({ icon, label, to, onChoose }: StepProps) {
  return (
    <ActionIcon
      variant="subtle"
      color="gray"
      c="inherit"
      className={classes.step ?? ""}
      size={44}
      aria-label={label}
      title={label}
      aria-disabled={to === undefined}
      {...(to === undefined && { "data-disabled": true })}
      onClick={() => to !== undefined && onChoose(to)}
    >
      <Icon name={icon} />
    </ActionIcon>
  );
}
