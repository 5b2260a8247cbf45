import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useId, useState } from "react";
import { answered, api } from "../api/client";
import { Moment } from "../Moment";
import classes from "../people/People.module.css";
import { Trouble } from "../people/parts";
import { deliveriesQuery, done, type EventType, TYPES, type Webhook, webhooksQuery } from "./queries";
import own from "./Settings.module.css";
import { settingsTexts } from "./texts";

export function WebhooksSection({ webhooks }: { readonly webhooks: readonly Webhook[] }) {
  const { webhooks: words } = settingsTexts;
  const titleId = useId();
  const [secret, setSecret] = useState<{ readonly of: string; readonly value: string } | null>(null);
  return (
    <section aria-labelledby={titleId}>
      <h2 id={titleId}>{words.title}</h2>
      <p>{words.lead}</p>
      <ul className={classes.list}>
        {webhooks.map((webhook) => (
          <WebhookItem
            key={webhook.id}
            webhook={webhook}
            secret={secret?.of === webhook.id ? secret.value : null}
            onSecret={(value) => setSecret({ of: webhook.id, value })}
          />
        ))}
      </ul>
      <NewWebhook onMade={(made) => setSecret({ of: made.id, value: made.secret })} />
    </section>
  );
}

interface WebhookItemProps {
  readonly webhook: Webhook;
  readonly secret: string | null;
  readonly onSecret: (secret: string) => void;
}

function WebhookItem({ webhook, secret, onSecret }: WebhookItemProps) {
  const { webhooks: words } = settingsTexts;
  const queries = useQueryClient();
  const [open, setOpen] = useState(false);
  const params = { path: { webhook: webhook.id } };
  const settle = { onSettled: () => queries.invalidateQueries({ queryKey: webhooksQuery.queryKey }) };
  const enable = useMutation({
    mutationFn: (enabled: boolean) => answered(api.PATCH("/api/v1/webhooks/{webhook}", { params, body: { enabled } })),
    ...settle,
  });
  const renew = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/webhooks/{webhook}/secret", { params })),
    onSuccess: (made) => onSecret(made.secret),
    ...settle,
  });
  const remove = useMutation({
    mutationFn: () => done(api.DELETE("/api/v1/webhooks/{webhook}", { params })),
    ...settle,
  });
  const test = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/webhooks/{webhook}/test", { params })),
    onSuccess: () => setOpen(true),
    ...settle,
  });
  const error = enable.error ?? renew.error ?? remove.error ?? test.error;
  return (
    <li>
      <p>
        <strong>{webhook.label || webhook.url}</strong> {webhook.enabled ? words.enabled : words.disabled}
      </p>
      {webhook.label && <p className={classes.soft}>{webhook.url}</p>}
      <p className={classes.soft}>{webhook.types.map((type) => words.type[type] ?? type).join(", ")}</p>
      {webhook.failures > 0 && <p className={classes.trouble}>{words.failing(webhook.failures)}</p>}
      {webhook.disabled_reason && <p className={classes.trouble}>{webhook.disabled_reason}</p>}
      {secret && (
        <p className={classes.secret} role="status">
          {words.secret} <code>{secret}</code>
        </p>
      )}
      <Trouble error={error} />
      <div className={classes.actions}>
        <Button mih={40} variant="default" aria-expanded={open} onClick={() => setOpen(!open)}>
          {words.deliveries}
        </Button>
        <Button mih={40} variant="default" loading={test.isPending} onClick={() => test.mutate()}>
          {settingsTexts.test}
        </Button>
        <Button mih={40} variant="default" onClick={() => enable.mutate(!webhook.enabled)}>
          {webhook.enabled ? words.disable : words.enable}
        </Button>
        <Button mih={40} variant="default" onClick={() => renew.mutate()}>
          {words.renew}
        </Button>
        <Button mih={40} variant="default" onClick={() => remove.mutate()}>
          {settingsTexts.remove}
        </Button>
      </div>
      {open && <Deliveries webhook={webhook.id} />}
    </li>
  );
}

function Deliveries({ webhook }: { readonly webhook: string }) {
  const { webhooks: words } = settingsTexts;
  const queries = useQueryClient();
  const found = useQuery(deliveriesQuery(webhook));
  const again = useMutation({
    mutationFn: (delivery: number) =>
      answered(
        api.POST("/api/v1/webhooks/{webhook}/deliveries/{delivery}/replay", {
          params: { path: { webhook, delivery } },
        }),
      ),
    onSettled: () => queries.invalidateQueries({ queryKey: deliveriesQuery(webhook).queryKey }),
  });
  const error = found.error ?? again.error;
  if (error) return <Trouble error={error} />;
  if (!found.data) return null;
  if (found.data.items.length === 0) return <p>{words.noDeliveries}</p>;
  return (
    <ol className={own.deliveries} aria-label={words.deliveries}>
      {found.data.items.map(({ id, type, state, attempts, created_at, reason }) => (
        <li key={id} data-state={state}>
          <div>
            <strong>{words.state[state]}</strong>: {words.type[type] ?? type}, <Moment at={created_at} />
            {attempts > 1 && `, ${words.attempts(attempts)}`}
            {reason && <p>{reason}</p>}
          </div>
          {state !== "waiting" && (
            <Button mih={36} variant="default" onClick={() => again.mutate(id)}>
              {words.again}
            </Button>
          )}
        </li>
      ))}
    </ol>
  );
}

type Made = Webhook & { readonly secret: string };

function NewWebhook({ onMade }: { readonly onMade: (made: Made) => void }) {
  const { webhooks: words } = settingsTexts;
  const queries = useQueryClient();
  const ids = useId();
  const [url, setUrl] = useState("");
  const [label, setLabel] = useState("");
  const [types, setTypes] = useState<readonly EventType[]>(TYPES);
  const add = useMutation({
    mutationFn: () =>
      answered(
        api.POST("/api/v1/webhooks", {
          body: { url, label, scope: "own", types: types.length === TYPES.length ? null : [...types] },
        }),
      ),
    onSuccess: (made) => {
      onMade(made);
      setUrl("");
      setLabel("");
    },
    onSettled: () => queries.invalidateQueries({ queryKey: webhooksQuery.queryKey }),
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    add.mutate();
  };
  return (
    <form className={classes.form} onSubmit={submit}>
      <label htmlFor={`${ids}-url`}>{words.url}</label>
      <input
        id={`${ids}-url`}
        type="url"
        required
        maxLength={2000}
        value={url}
        onChange={({ currentTarget }) => setUrl(currentTarget.value)}
      />
      <label htmlFor={`${ids}-label`}>{words.label}</label>
      <input
        id={`${ids}-label`}
        maxLength={200}
        value={label}
        onChange={({ currentTarget }) => setLabel(currentTarget.value)}
      />
      <fieldset className={classes.choices}>
        <legend>{words.types}</legend>
        {TYPES.map((type) => (
          <label key={type}>
            <input
              type="checkbox"
              checked={types.includes(type)}
              onChange={({ currentTarget: { checked } }) =>
                setTypes(TYPES.filter((one) => (one === type ? checked : types.includes(one))))
              }
            />
            {words.type[type]}
          </label>
        ))}
      </fieldset>
      <Trouble error={add.error} />
      <Button type="submit" mih={44} disabled={types.length === 0} loading={add.isPending}>
        {words.add}
      </Button>
    </form>
  );
}
