import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api, type Schemas } from "../api/client";
import { Moment } from "../Moment";
import { Failure, Loading } from "../pages/states";
import { texts } from "../texts";
import { browserName } from "./browsers";
import classes from "./People.module.css";
import { Act, Field, Form, Secret, Section, Trouble } from "./parts";
import { accountQuery, done, type Scope, type Session, sessionsQuery, tokensQuery } from "./queries";
import { SignOut } from "./SignOut";
import { peopleTexts } from "./texts";

type Account = Schemas["OwnAccount"];

/** One's own: the password, browsers that are signed in, tokens for programs. */
export function AccountPage() {
  const { account: words } = peopleTexts;
  const account = useQuery({ ...accountQuery, refetchOnMount: "always" });
  if (account.isError && !account.data) {
    return <Failure what={peopleTexts.failed} error={account.error} retry={() => void account.refetch()} />;
  }
  if (!account.data) return <Loading />;
  const { email, duty } = account.data;
  return (
    <>
      <title>{`${words.title} · ${texts.product}`}</title>
      <h1>{words.title}</h1>
      <p>
        {email ? <strong>{email}</strong> : words.nobody}
        {email && duty && `, ${words.duty[duty]}`}
      </p>
      <SignOut />
      {email && <Password account={account.data} email={email} />}
      <Sessions />
      <AnotherBrowser />
      {email && <Tokens staff={duty !== null} operator={duty === "operator"} />}
    </>
  );
}

function Password({ account, email }: { readonly account: Account; readonly email: string }) {
  const { account: words } = peopleTexts;
  const queries = useQueryClient();
  const [current, setCurrent] = useState("");
  const [wanted, setWanted] = useState("");
  const change = useMutation({
    mutationFn: () =>
      done(
        api.PUT("/api/v1/account/password", {
          body: { current: account.has_password ? current : null, new: wanted },
        }),
      ),
    onSuccess: () => {
      setCurrent("");
      setWanted("");
    },
    onSettled: () => queries.invalidateQueries({ queryKey: accountQuery.queryKey }),
  });
  return (
    <Section title={words.passwordTitle}>
      {!account.has_password && <p>{words.none}</p>}
      <Form
        label={words.passwordTitle}
        submit={account.has_password ? words.change : words.set}
        pending={change.isPending}
        error={change.error}
        problems={{ 403: words.wrong, 422: peopleTexts.weak }}
        onSubmit={() => change.mutate()}
      >
        <input type="email" autoComplete="username" value={email} readOnly hidden />
        {account.has_password && (
          <Field
            label={words.current}
            type="password"
            autoComplete="current-password"
            required
            value={current}
            onValue={setCurrent}
          />
        )}
        <Field
          label={peopleTexts.newPassword}
          hint={peopleTexts.passwordHint}
          type="password"
          autoComplete="new-password"
          minLength={12}
          required
          value={wanted}
          onValue={setWanted}
        />
        {change.isSuccess && <p role="status">{words.changed}</p>}
      </Form>
    </Section>
  );
}

function Sessions() {
  const { account: words } = peopleTexts;
  const queries = useQueryClient();
  const sessions = useQuery({ ...sessionsQuery, refetchOnMount: "always" });
  const settle = { onSettled: () => queries.invalidateQueries({ queryKey: sessionsQuery.queryKey }) };
  const end = useMutation({
    mutationFn: (session: string) =>
      done(api.DELETE("/api/v1/account/sessions/{session}", { params: { path: { session } } })),
    ...settle,
  });
  const endOthers = useMutation({ mutationFn: () => done(api.DELETE("/api/v1/account/sessions")), ...settle });
  const items: readonly Session[] = sessions.data?.items ?? [];
  return (
    <Section title={words.sessions}>
      <ul className={classes.list}>
        {items.map((session) => {
          const browser = browserName(session.agent) ?? words.unknownBrowser;
          return (
            <li key={session.id}>
              <p>
                <strong>{browser}</strong> {session.current && `(${words.here})`}
              </p>
              <p className={classes.soft}>
                {words.way[session.way]}, {words.seen} <Moment at={session.seen_at} />
              </p>
              {!session.current && (
                <Act name={words.endOf(browser)} pending={end.isPending} onClick={() => end.mutate(session.id)}>
                  {words.end}
                </Act>
              )}
            </li>
          );
        })}
      </ul>
      <Trouble error={sessions.error ?? end.error ?? endOthers.error} />
      {items.length > 1 && (
        <Button mt={12} mih={44} variant="default" loading={endOthers.isPending} onClick={() => endOthers.mutate()}>
          {words.endOthers}
        </Button>
      )}
    </Section>
  );
}

function AnotherBrowser() {
  const { account: words } = peopleTexts;
  const make = useMutation({ mutationFn: () => answered(api.POST("/api/v1/account/login-links")) });
  return (
    <Section title={words.another}>
      <p>{words.anotherLead}</p>
      {make.data?.url && <Secret text={words.another}>{make.data.url}</Secret>}
      <Trouble error={make.error} />
      <Button mih={44} variant="default" loading={make.isPending} onClick={() => make.mutate()}>
        {words.makeLink}
      </Button>
    </Section>
  );
}

function Tokens({ staff, operator }: { readonly staff: boolean; readonly operator: boolean }) {
  const { account: words } = peopleTexts;
  const queries = useQueryClient();
  const tokens = useQuery({ ...tokensQuery, refetchOnMount: "always" });
  const settle = { onSettled: () => queries.invalidateQueries({ queryKey: tokensQuery.queryKey }) };
  const [name, setName] = useState("");
  const [scopes, setScopes] = useState<readonly Scope[]>(["maps:read"]);
  const add = useMutation({
    mutationFn: () =>
      answered(api.POST("/api/v1/account/tokens", { body: { name: name.trim(), scopes: [...scopes] } })),
    onSuccess: () => setName(""),
    ...settle,
  });
  const end = useMutation({
    mutationFn: (token: string) => done(api.DELETE("/api/v1/account/tokens/{token}", { params: { path: { token } } })),
    ...settle,
  });
  const offered = (Object.keys(words.scopes) as Scope[]).filter((scope) =>
    scope === "robots" ? operator : staff || !scope.startsWith("fleet"),
  );
  return (
    <Section title={words.tokens}>
      <p>{words.tokensLead}</p>
      <ul className={classes.list}>
        {tokens.data?.items.map((token) => (
          <li key={token.id}>
            <p>
              <strong>{token.name}</strong>: {token.scopes.map((scope) => words.scopes[scope]).join("; ")}
            </p>
            <p className={classes.soft}>
              {token.seen_at ? (
                <>
                  {words.used} <Moment at={token.seen_at} />
                </>
              ) : (
                words.neverUsed
              )}
            </p>
            <Act name={words.revokeOf(token.name)} onClick={() => end.mutate(token.id)}>
              {words.revoke}
            </Act>
          </li>
        ))}
      </ul>
      <Trouble error={tokens.error ?? end.error} />
      {add.data && <Secret text={words.made}>{add.data.token}</Secret>}
      <Form
        label={words.tokens}
        submit={words.add}
        pending={add.isPending}
        error={add.error}
        onSubmit={() => scopes.length > 0 && add.mutate()}
      >
        <Field label={words.tokenName} required maxLength={100} value={name} onValue={setName} />
        <fieldset className={classes.choices}>
          <legend>{words.scopesTitle}</legend>
          {offered.map((scope) => (
            <label key={scope}>
              <input
                type="checkbox"
                checked={scopes.includes(scope)}
                onChange={({ currentTarget: { checked } }) =>
                  setScopes(offered.filter((one) => (one === scope ? checked : scopes.includes(one))))
                }
              />
              {words.scopes[scope]}
            </label>
          ))}
        </fieldset>
      </Form>
    </Section>
  );
}
