import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useId } from "react";
import { api } from "../api/client";
import { Moment } from "../Moment";
import classes from "../people/People.module.css";
import { Trouble } from "../people/parts";
import { Kinds } from "./Kinds";
import { canPush, ownSubscription, PushDenied, subscribe, unsubscribe } from "./push";
import { done, type Settings, settingsQuery } from "./queries";
import { settingsTexts } from "./texts";

const OWN = ["own push"];

/** Messages that a browser shows while the page is closed, on each where somebody wants it. */
export function PushSection({ push }: { readonly push: Settings["push"] }) {
  const { push: words } = settingsTexts;
  const queries = useQueryClient();
  const titleId = useId();
  const own = useQuery({ queryKey: OWN, queryFn: ownSubscription });
  const refresh = () =>
    Promise.all([
      queries.invalidateQueries({ queryKey: OWN }),
      queries.invalidateQueries({ queryKey: settingsQuery.queryKey }),
    ]);
  const start = useMutation({ mutationFn: () => subscribe(push.public_key), onSettled: refresh });
  const stop = useMutation({
    mutationFn: async (id: string) => {
      if (id === own.data) await unsubscribe();
      return done(
        api.DELETE("/api/v1/notifications/push/subscriptions/{subscription}", {
          params: { path: { subscription: id } },
        }),
      );
    },
    onSettled: refresh,
  });
  const test = useMutation({
    mutationFn: (id: string) =>
      done(
        api.POST("/api/v1/notifications/push/subscriptions/{subscription}/test", {
          params: { path: { subscription: id } },
        }),
      ),
  });
  const isOn = push.subscriptions.some(({ id }) => id === own.data);
  const denied = start.error instanceof PushDenied || (canPush() && Notification.permission === "denied");
  const error = denied ? null : (start.error ?? stop.error ?? test.error);
  return (
    <section aria-labelledby={titleId}>
      <h2 id={titleId}>{words.title}</h2>
      <p role="status">{!canPush() ? words.none : denied ? words.denied : isOn ? words.on : words.off}</p>
      {canPush() && !isOn && !denied && (
        <Button mih={44} loading={start.isPending} onClick={() => start.mutate()}>
          {words.start}
        </Button>
      )}
      <Trouble error={error} />
      {push.subscriptions.length > 0 && (
        <>
          <h3>{words.others}</h3>
          <ul className={classes.list}>
            {push.subscriptions.map(({ id, label, created_at, trouble }) => (
              <li key={id}>
                <p>
                  <strong>{label || words.unnamed}</strong>
                  {id === own.data && ` (${words.here})`}, <Moment at={created_at} />
                </p>
                {trouble && <p className={classes.trouble}>{settingsTexts.trouble(trouble)}</p>}
                <div className={classes.actions}>
                  <Button mih={40} variant="default" loading={test.isPending} onClick={() => test.mutate(id)}>
                    {settingsTexts.test}
                  </Button>
                  <Button mih={40} variant="default" loading={stop.isPending} onClick={() => stop.mutate(id)}>
                    {id === own.data ? words.stop : settingsTexts.remove}
                  </Button>
                </div>
              </li>
            ))}
          </ul>
          <p role="status">{test.isSuccess && settingsTexts.testSent}</p>
          <Kinds way="push" kinds={push.kinds} />
        </>
      )}
    </section>
  );
}
