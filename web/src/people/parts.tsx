/** What forms and lists about people are made of. */

import { Button } from "@mantine/core";
import { type FormEvent, type InputHTMLAttributes, type ReactNode, useId } from "react";
import classes from "./People.module.css";
import { said } from "./queries";

interface FieldProps extends Omit<InputHTMLAttributes<HTMLInputElement>, "onChange" | "value"> {
  readonly label: string;
  readonly value: string;
  readonly onValue: (value: string) => void;
  readonly hint?: string;
}

export function Field({ label, value, onValue, hint, ...rest }: FieldProps) {
  const id = useId();
  return (
    <>
      <label htmlFor={id}>{label}</label>
      <input
        id={id}
        value={value}
        aria-describedby={hint ? `${id}-hint` : undefined}
        onChange={({ currentTarget }) => onValue(currentTarget.value)}
        {...rest}
      />
      {hint && (
        <p id={`${id}-hint`} className={classes.hint}>
          {hint}
        </p>
      )}
    </>
  );
}

interface ChoiceProps<T extends string> {
  readonly label: string;
  readonly value: T;
  readonly options: Readonly<Record<T, string>>;
  readonly onValue: (value: T) => void;
  readonly bare?: boolean;
}

/** `bare`: the label is for those who hear the page, who don't see what it stands beside. */
export function Choice<T extends string>({ label, value, options, onValue, bare = false }: ChoiceProps<T>) {
  const id = useId();
  return (
    <>
      {!bare && <label htmlFor={id}>{label}</label>}
      <select
        id={id}
        className={classes.select}
        aria-label={bare ? label : undefined}
        value={value}
        onChange={({ currentTarget }) => onValue(currentTarget.value as T)}
      >
        {(Object.keys(options) as T[]).map((one) => (
          <option key={one} value={one}>
            {options[one]}
          </option>
        ))}
      </select>
    </>
  );
}

interface FormProps {
  readonly onSubmit: () => void;
  readonly submit: string;
  readonly pending: boolean;
  readonly error?: Error | null | undefined;
  readonly problems?: Readonly<Record<number, string>> | undefined;
  readonly label?: string;
  readonly children: ReactNode;
}

export function Form({ onSubmit, submit, pending, error, problems, label, children }: FormProps) {
  const send = (event: FormEvent) => {
    event.preventDefault();
    onSubmit();
  };
  return (
    <form className={classes.form} onSubmit={send} aria-label={label}>
      {children}
      <Trouble error={error} problems={problems} />
      <Button type="submit" mih={44} loading={pending}>
        {submit}
      </Button>
    </form>
  );
}

interface TroubleProps {
  readonly error?: Error | null | undefined;
  readonly problems?: Readonly<Record<number, string>> | undefined;
}

export function Trouble({ error, problems }: TroubleProps) {
  if (!error) return null;
  return (
    <p className={classes.trouble} role="alert">
      {said(error, problems)}
    </p>
  );
}

export function Section({ title, children }: { readonly title: string; readonly children: ReactNode }) {
  const id = useId();
  return (
    <section aria-labelledby={id}>
      <h2 id={id}>{title}</h2>
      {children}
    </section>
  );
}

/** Something that is shown once. */
export function Secret({ text, children }: { readonly text: string; readonly children: string }) {
  return (
    <p className={classes.secret} role="status">
      {text} <code>{children}</code>
    </p>
  );
}

interface ActProps {
  readonly name: string;
  readonly children: string;
  readonly pending?: boolean;
  readonly onClick: () => void;
}

/** A button of a row; `name` says also of which. */
export function Act({ name, children, pending = false, onClick }: ActProps) {
  return (
    <Button mih={40} variant="default" aria-label={name} loading={pending} onClick={onClick}>
      {children}
    </Button>
  );
}
