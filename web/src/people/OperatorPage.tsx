import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api, type Schemas } from "../api/client";
import { Moment } from "../Moment";
import { Failure, Loading } from "../pages/states";
import { texts } from "../texts";
import { Invite } from "./Invite";
import classes from "./People.module.css";
import { Act, Choice, Field, Form, Secret, Section, Trouble } from "./parts";
import { type Account, accountsQuery, type Duty, done, invitationsQuery, type Robot, registryQuery } from "./queries";
import { peopleTexts } from "./texts";

/** Robots and accounts, for those who run the service. */
export function OperatorPage({ email }: { readonly email: string | null }) {
  const { operator: words } = peopleTexts;
  const robots = useQuery({ ...registryQuery, refetchOnMount: "always" });
  const accounts = useQuery({ ...accountsQuery, refetchOnMount: "always" });
  const failed = [robots, accounts].find(({ isError, data }) => isError && !data);
  if (failed) return <Failure what={peopleTexts.failed} error={failed.error} retry={() => void failed.refetch()} />;
  if (!robots.data || !accounts.data) return <Loading />;
  return (
    <>
      <title>{`${words.title} · ${texts.product}`}</title>
      <h1>{words.title}</h1>
      <p>{words.lead}</p>
      <Section title={words.robots}>
        <ul className={classes.list}>
          {robots.data.items.map((robot) => (
            <RobotItem key={robot.id} robot={robot} />
          ))}
        </ul>
        <h3>{words.register}</h3>
        <Register />
      </Section>
      <Section title={words.accounts}>
        <ul className={classes.list}>
          {accounts.data.items.map((account) => (
            <AccountItem key={account.id} account={account} own={account.email === email} />
          ))}
        </ul>
        <Invitations />
        <h3>{words.invite}</h3>
        <InviteAccount />
      </Section>
    </>
  );
}

function RobotItem({ robot }: { readonly robot: Robot }) {
  const { operator: words } = peopleTexts;
  const queries = useQueryClient();
  const { id, name, owner, released_at, token_made_at } = robot;
  const params = { path: { robot: id } };
  const settle = { onSettled: () => queries.invalidateQueries({ queryKey: registryQuery.queryKey }) };
  const code = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/robots/{robot}/claim-code", { params })),
    ...settle,
  });
  const rekey = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/robots/{robot}/token", { params })),
    ...settle,
  });
  const disconnect = useMutation({
    mutationFn: () => done(api.DELETE("/api/v1/robots/{robot}/token", { params })),
    ...settle,
  });
  return (
    <li>
      <p>
        <strong>{name}</strong> {name !== id && <span className={classes.soft}>{id}</span>}
      </p>
      <p className={classes.soft}>
        {owner ?? (released_at ? words.released : words.nobodys)}
        {token_made_at === null && `, ${words.shutOut}`}
      </p>
      {code.data && <Secret text={`${words.registered} ${words.code}`}>{code.data.claim_code}</Secret>}
      {rekey.data && <Secret text={`${words.registered} ${words.token}`}>{rekey.data.token}</Secret>}
      <Trouble error={code.error ?? rekey.error ?? disconnect.error} />
      <div className={classes.actions}>
        {owner === null && (
          <>
            <Act name={words.newCodeOf(id)} onClick={() => code.mutate()}>
              {words.newCode}
            </Act>
            <Act name={words.rekeyOf(id)} onClick={() => rekey.mutate()}>
              {words.rekey}
            </Act>
          </>
        )}
        {token_made_at !== null && (
          <Act name={words.disconnectOf(id)} onClick={() => disconnect.mutate()}>
            {words.disconnect}
          </Act>
        )}
      </div>
    </li>
  );
}

function Register() {
  const { operator: words } = peopleTexts;
  const queries = useQueryClient();
  const [id, setId] = useState("");
  const [name, setName] = useState("");
  const [owner, setOwner] = useState("");
  const register = useMutation({
    mutationFn: () =>
      answered(api.POST("/api/v1/robots", { body: { id, name: name.trim() || null, owner: owner.trim() || null } })),
    onSuccess: () => {
      setId("");
      setName("");
      setOwner("");
    },
    onSettled: () => Promise.all([["registry"], ["robots"]].map((queryKey) => queries.invalidateQueries({ queryKey }))),
  });
  const made: Schemas["CreatedRobot"] | undefined = register.data;
  return (
    <Form
      label={words.register}
      submit={words.register}
      pending={register.isPending}
      error={register.error}
      problems={{ 409: words.robotExists }}
      onSubmit={() => register.mutate()}
    >
      <Field
        label={words.robotId}
        required
        maxLength={64}
        pattern="[A-Za-z0-9][A-Za-z0-9._\-]{0,63}"
        value={id}
        onValue={setId}
      />
      <Field label={words.robotName} maxLength={100} value={name} onValue={setName} />
      <Field label={words.ownerLabel} type="email" value={owner} onValue={setOwner} />
      {made && (
        <>
          <Secret text={`${words.registered} ${words.token}`}>{made.token}</Secret>
          {made.owner === null && <Secret text={`${words.registered} ${words.code}`}>{made.claim_code}</Secret>}
        </>
      )}
    </Form>
  );
}

type DutyChoice = Duty | "none";

function AccountItem({ account, own }: { readonly account: Account; readonly own: boolean }) {
  const { operator: words } = peopleTexts;
  const queries = useQueryClient();
  const { id, email, duty, disabled_at } = account;
  const params = { path: { account: id } };
  const change = useMutation({
    mutationFn: (body: Schemas["AccountChange"]) => answered(api.PATCH("/api/v1/accounts/{account}", { params, body })),
    onSettled: () => queries.invalidateQueries({ queryKey: accountsQuery.queryKey }),
  });
  const reset = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/accounts/{account}/password-reset", { params })),
  });
  const off = disabled_at !== null;
  return (
    <li>
      <p>
        <strong>{email}</strong> {off && <span className={classes.soft}>{words.off}</span>}
      </p>
      {reset.data && <Handed link={reset.data} />}
      <Trouble error={change.error ?? reset.error} />
      {!own && (
        <div className={classes.actions}>
          <Choice<DutyChoice>
            bare
            label={words.dutyOf(email)}
            value={duty ?? "none"}
            options={words.duty}
            onValue={(wanted) => change.mutate({ duty: wanted === "none" ? null : wanted })}
          />
          <Act
            name={off ? words.switchOnOf(email) : words.switchOffOf(email)}
            onClick={() => change.mutate({ disabled: !off })}
          >
            {off ? words.switchOn : words.switchOff}
          </Act>
          <Act name={words.resetOf(email)} pending={reset.isPending} onClick={() => reset.mutate()}>
            {words.reset}
          </Act>
        </div>
      )}
    </li>
  );
}

/** A link that went by e-mail, or that whoever reads this hands over. */
function Handed({ link }: { readonly link: Schemas["OneTimeLink"] }) {
  const { operator: words } = peopleTexts;
  return link.url ? <Secret text={words.link}>{link.url}</Secret> : <p role="status">{words.posted}</p>;
}

function Invitations() {
  const { home: words } = peopleTexts;
  const queries = useQueryClient();
  const invitations = useQuery({ ...invitationsQuery, refetchOnMount: "always" });
  const withdraw = useMutation({
    mutationFn: (invitation: string) =>
      done(api.DELETE("/api/v1/accounts/invitations/{invitation}", { params: { path: { invitation } } })),
    onSettled: () => queries.invalidateQueries({ queryKey: invitationsQuery.queryKey }),
  });
  const items = invitations.data?.items ?? [];
  if (items.length === 0) return <Trouble error={invitations.error} />;
  return (
    <ul className={classes.list} aria-label={words.invited}>
      {items.map(({ id, email, created_at }) => (
        <li key={id}>
          <p>
            <strong>{email}</strong>
          </p>
          <p className={classes.soft}>
            {words.invited}, <Moment at={created_at} />
          </p>
          <Act name={words.withdrawOf(email)} onClick={() => withdraw.mutate(id)}>
            {words.withdraw}
          </Act>
        </li>
      ))}
    </ul>
  );
}

function InviteAccount() {
  const { operator: words } = peopleTexts;
  return (
    <Invite<DutyChoice, Schemas["OneTimeLink"]>
      label={words.invite}
      submit={words.send}
      as={words.asDuty}
      options={words.duty}
      first="none"
      problems={{ 409: words.exists }}
      invite={(email, duty) =>
        answered(api.POST("/api/v1/accounts/invitations", { body: { email, duty: duty === "none" ? null : duty } }))
      }
      queryKey={invitationsQuery.queryKey}
    >
      {(link) => <Handed link={link} />}
    </Invite>
  );
}
