/** Saving what is kept, and bringing it in. */

import { Button } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { answered, api } from "../api/client";
import classes from "../people/People.module.css";
import { Trouble } from "../people/parts";
import { privacyTexts as words } from "./texts";

/** All robots of one's home in one file. */
export function WholeHome() {
  const queries = useQueryClient();
  const bringIn = useMutation({
    mutationFn: (file: File) => answered(api.POST("/api/v1/home/archive", zipped(file))),
    onSettled: () => queries.invalidateQueries(),
  });
  const made = bringIn.data?.robots ?? [];
  const count = (of: (robot: (typeof made)[number]) => number) => made.reduce((sum, robot) => sum + of(robot), 0);
  return (
    <>
      <p className={classes.soft}>{words.whole}</p>
      <div className={classes.actions}>
        <Save href="/api/v1/home/archive" file="home.zip" name={words.saveHome}>
          {words.saveHome}
        </Save>
        <Pick name={words.bringInHome} pending={bringIn.isPending} onFile={(file) => bringIn.mutate(file)}>
          {words.bringInHome}
        </Pick>
      </div>
      {bringIn.data && (
        <p role="status">
          {words.broughtIn(
            count(({ maps }) => maps.length),
            count(({ versions }) => versions),
          )}
        </p>
      )}
      <Trouble error={bringIn.error} problems={{ 409: words.clash, 422: words.unreadable }} />
    </>
  );
}

/** An archive as it is sent. */
export function zipped(file: File) {
  return {
    body: file as unknown as string,
    bodySerializer: (body: string) => body as unknown as File,
    headers: { "Content-Type": "application/zip" },
  };
}

interface SaveProps {
  readonly href: string;
  readonly file: string;
  readonly name: string;
  readonly children: string;
}

export function Save({ href, file, name, children }: SaveProps) {
  return (
    <Button component="a" mih={40} variant="default" href={href} download={file} aria-label={name}>
      {children}
    </Button>
  );
}

interface PickProps {
  readonly name: string;
  readonly pending: boolean;
  readonly onFile: (file: File) => void;
  readonly children: string;
}

/** A button that asks for a file. */
export function Pick({ name, pending, onFile, children }: PickProps) {
  return (
    <Button component="label" mih={40} variant="default" loading={pending}>
      {children}
      <input
        type="file"
        accept=".zip,application/zip"
        aria-label={name}
        style={{ position: "absolute", inset: 0, opacity: 0 }}
        onChange={({ currentTarget }) => {
          const file = currentTarget.files?.[0];
          if (file) onFile(file);
          currentTarget.value = "";
        }}
      />
    </Button>
  );
}
