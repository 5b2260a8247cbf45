import { Button } from "@mantine/core";
import { useState } from "react";
import classes from "../people/People.module.css";
import { Field } from "../people/parts";
import { privacyTexts as words } from "./texts";

interface SureProps {
  readonly title: string;
  readonly text: string;
  readonly name: string;
  readonly pending: boolean;
  readonly yes: () => void;
  readonly no: () => void;
}

/** Deleting is for good: it takes the name of what is deleted, typed. */
export function Sure({ title, text, name, pending, yes, no }: SureProps) {
  const [typed, setTyped] = useState("");
  return (
    <fieldset className={classes.form} style={{ border: 0, margin: 0, padding: 0 }}>
      <legend>
        <strong>{title}</strong>
      </legend>
      <p>{text}</p>
      <Field label={words.confirm(name)} autoComplete="off" spellCheck={false} value={typed} onValue={setTyped} />
      <div className={classes.actions}>
        <Button mih={44} variant="default" onClick={no}>
          {words.cancel}
        </Button>
        <Button mih={44} color="red" disabled={typed !== name} loading={pending} onClick={yes}>
          {words.yes}
        </Button>
      </div>
    </fieldset>
  );
}
