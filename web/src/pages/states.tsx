import { Button, Skeleton } from "@mantine/core";
import type { ReactNode } from "react";
import { Link } from "wouter";
import { Problem } from "../api/client";
import { texts } from "../texts";
import classes from "./states.module.css";

/** A quiet page of its own: a heading, some lines, perhaps a button. */
export function Notice({ title, children }: { readonly title: string; readonly children: ReactNode }) {
  return (
    <section className={classes.notice}>
      <h1>{title}</h1>
      {children}
    </section>
  );
}

export function Loading() {
  return (
    <div className={classes.loading} role="status">
      <span className="visually-hidden">{texts.loading}</span>
      <Skeleton height={36} width={180} radius="md" />
      <Skeleton height={220} radius="lg" />
      <Skeleton height={220} radius="lg" />
    </div>
  );
}

interface FailureProps {
  readonly what: string;
  readonly error: Error | null;
  readonly retry: () => void;
}

export function Failure({ what, error, retry }: FailureProps) {
  return (
    <Notice title={what}>
      <p role="alert">{error instanceof Problem ? error.message : texts.problem.unknown}</p>
      <Button size="md" onClick={retry}>
        {texts.retry}
      </Button>
    </Notice>
  );
}

export function Nothing({ text = texts.notFound.text }: { readonly text?: string }) {
  return (
    <Notice title={texts.notFound.title}>
      <p>{text}</p>
      <Link href="/">{texts.notFound.back}</Link>
    </Notice>
  );
}

export function Command({ children }: { readonly children: string }) {
  return (
    // A long command scrolls sideways inside its box, which therefore has to take the focus.
    // biome-ignore lint/a11y/noNoninteractiveTabindex: see above
    <pre className={classes.command} tabIndex={0}>
      <code>{children}</code>
    </pre>
  );
}
