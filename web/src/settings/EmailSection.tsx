import { Button } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useId, useState } from "react";
import { answered, api } from "../api/client";
import classes from "../people/People.module.css";
import { Trouble } from "../people/parts";
import { language } from "../texts";
import { Kinds } from "./Kinds";
import { done, type Settings, settingsQuery } from "./queries";
import { settingsTexts } from "./texts";

export function EmailSection({ email }: { readonly email: Settings["email"] }) {
  const { email: words } = settingsTexts;
  const queries = useQueryClient();
  const ids = useId();
  const [address, setAddress] = useState(email.address ?? email.suggested ?? "");
  const set = useMutation({
    mutationFn: (wanted: string) =>
      answered(api.PUT("/api/v1/notifications/email", { body: { address: wanted, language } })),
    onSuccess: (settings) => queries.setQueryData(settingsQuery.queryKey, settings),
  });
  const remove = useMutation({
    mutationFn: () => done(api.DELETE("/api/v1/notifications/email")),
    onSettled: () => queries.invalidateQueries({ queryKey: settingsQuery.queryKey }),
  });
  const submit = (event: FormEvent) => {
    event.preventDefault();
    set.mutate(address.trim());
  };
  const error = set.error ?? remove.error;
  return (
    <section aria-labelledby={`${ids}-title`}>
      <h2 id={`${ids}-title`}>{words.title}</h2>
      {!email.available ? (
        <p>{words.none}</p>
      ) : (
        <>
          {email.address !== null && (
            <p role="status">{email.confirmed ? words.confirmed(email.address) : words.waiting(email.address)}</p>
          )}
          {email.trouble && <p className={classes.trouble}>{settingsTexts.trouble(email.trouble)}</p>}
          <form className={classes.form} onSubmit={submit}>
            <label htmlFor={`${ids}-address`}>{words.address}</label>
            <input
              id={`${ids}-address`}
              type="email"
              required
              maxLength={320}
              autoComplete="email"
              value={address}
              onChange={({ currentTarget }) => setAddress(currentTarget.value)}
            />
            <div className={classes.actions}>
              <Button type="submit" mih={44} loading={set.isPending}>
                {email.address === address.trim() && !email.confirmed ? words.again : words.save}
              </Button>
              {email.address !== null && (
                <Button mih={44} variant="default" loading={remove.isPending} onClick={() => remove.mutate()}>
                  {settingsTexts.remove}
                </Button>
              )}
            </div>
          </form>
          <Trouble error={error} />
          <Kinds way="email" kinds={email.kinds} />
        </>
      )}
    </section>
  );
}
