import { Button } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useId, useState } from "react";
import { answered, api } from "../api/client";
import { refreshAll } from "../api/queries";
import type { Version } from "../map/history";
import { texts } from "../texts";
import classes from "./HistoryPanel.module.css";

interface VersionActionsProps {
  readonly version: Version;
  readonly isNewest: boolean;
  readonly pinned: number | null;
  readonly newest: number;
  readonly mayEdit: boolean;
  readonly onCompare: (before: number, after: number) => void;
  /** Called when another version has come into force by what was done here. */
  readonly onNewest: () => void;
}

/** What can be done with a version: compared, brought back, pinned, named. */
export function VersionActions(props: VersionActionsProps) {
  const { version, isNewest, pinned, newest, mayEdit, onCompare, onNewest } = props;
  const queries = useQueryClient();
  const path = { robot: version.robot, map: version.map, version: version.version };
  const settle = { onSettled: () => refreshAll(queries) };
  const restore = useMutation({
    mutationFn: () =>
      answered(api.POST("/api/v1/robots/{robot}/maps/{map}/versions/{version}/restore", { params: { path } })),
    onSuccess: onNewest,
    ...settle,
  });
  const pin = useMutation({
    mutationFn: (wanted: boolean) =>
      wanted
        ? answered(
            api.PUT("/api/v1/robots/{robot}/maps/{map}/pin", { params: { path }, body: { version: version.version } }),
          )
        : answered(api.DELETE("/api/v1/robots/{robot}/maps/{map}/pin", { params: { path } })),
    onSuccess: onNewest,
    ...settle,
  });
  const isPinned = pinned !== null && isNewest;
  const error = restore.error ?? pin.error;
  return (
    <div className={classes.actions}>
      {version.parent !== null && (
        <Button mih={40} variant="default" onClick={() => onCompare(version.parent ?? 0, version.version)}>
          {texts.history.whatChanged}
        </Button>
      )}
      {!isNewest && (
        <>
          <Button mih={40} variant="default" onClick={() => onCompare(version.version, newest)}>
            {texts.history.compareNow}
          </Button>
          {mayEdit && (
            <Button mih={40} loading={restore.isPending} onClick={() => restore.mutate()}>
              {texts.history.restore}
            </Button>
          )}
        </>
      )}
      {mayEdit && (
        <>
          <Button mih={40} variant="default" loading={pin.isPending} onClick={() => pin.mutate(!isPinned)}>
            {isPinned ? texts.history.unpin : texts.history.pin}
          </Button>
          <NameForm version={version} />
        </>
      )}
      {error && <p role="alert">{error.message}</p>}
    </div>
  );
}

function NameForm({ version }: { readonly version: Version }) {
  const queries = useQueryClient();
  const fieldId = useId();
  const [name, setName] = useState(version.name ?? "");
  const save = useMutation({
    mutationFn: (wanted: string | null) =>
      answered(
        api.PATCH("/api/v1/robots/{robot}/maps/{map}/versions/{version}", {
          params: { path: { robot: version.robot, map: version.map, version: version.version } },
          body: { name: wanted },
        }),
      ),
    onSettled: () => refreshAll(queries),
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    save.mutate(name.trim() || null);
  };
  return (
    <form className={classes.naming} onSubmit={submit}>
      <label htmlFor={fieldId}>{texts.history.name}</label>
      <input
        id={fieldId}
        value={name}
        maxLength={100}
        autoComplete="off"
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Button type="submit" mih={40} variant="default" loading={save.isPending}>
        {texts.history.setName}
      </Button>
      {save.error && <p role="alert">{save.error.message}</p>}
    </form>
  );
}
