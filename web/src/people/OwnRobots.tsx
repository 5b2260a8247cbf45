import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { answered, api } from "../api/client";
import { robotsQuery } from "../api/queries";
import { forgetDrafts } from "../editor/forgetting";
import classes from "./People.module.css";
import { Act, Field, Form, Secret, Section, Trouble } from "./parts";
import { peopleTexts } from "./texts";

const ROBOTS = robotsQuery.queryKey;

/** Robots of one's own: claimed, given up, and their tokens. */
export function OwnRobots({ email }: { readonly email: string }) {
  const { home: words } = peopleTexts;
  const robots = useQuery(robotsQuery);
  const [code, setCode] = useState<string | null>(null);
  const own = robots.data?.items.filter(({ owner }) => owner === email) ?? [];
  return (
    <Section title={words.robots}>
      {own.length === 0 && <p>{words.noRobots}</p>}
      <ul className={classes.list}>
        {own.map(({ id, name }) => (
          <OwnRobot key={id} id={id} name={name} onGivenUp={setCode} />
        ))}
      </ul>
      {code && <Secret text={words.givenUp}>{code}</Secret>}
      <h3>{words.claim}</h3>
      <p>{words.claimLead}</p>
      <Claim />
    </Section>
  );
}

interface OwnRobotProps {
  readonly id: string;
  readonly name: string;
  readonly onGivenUp: (code: string) => void;
}

function OwnRobot({ id, name, onGivenUp }: OwnRobotProps) {
  const { home: words } = peopleTexts;
  const queries = useQueryClient();
  const params = { path: { robot: id } };
  const [asked, setAsked] = useState(false);
  const robot = useQuery({
    queryKey: [...ROBOTS, id],
    queryFn: ({ signal }) => answered(api.GET("/api/v1/robots/{robot}", { params, signal })),
  });
  const renew = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/robots/{robot}/token", { params })),
    onSettled: () => queries.invalidateQueries({ queryKey: ROBOTS }),
  });
  const giveUp = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/robots/{robot}/release", { params })),
    onSuccess: ({ claim_code }) => {
      forgetDrafts(id);
      onGivenUp(claim_code);
    },
    onSettled: () => queries.invalidateQueries({ queryKey: ROBOTS }),
  });
  const kept = robot.data?.kept_from != null;
  return (
    <li>
      <p>
        <strong>{name}</strong> {name !== id && <span className={classes.soft}>{id}</span>}
      </p>
      {kept && <p className={classes.soft}>{words.kept}</p>}
      {!kept && robot.data?.token_made_at === null && <p className={classes.trouble}>{words.shutOut}</p>}
      {renew.data && <Secret text={words.newTokenText}>{renew.data.token}</Secret>}
      <Trouble error={renew.error ?? giveUp.error} />
      {robot.data && !kept && !asked && (
        <div className={classes.actions}>
          <Act name={words.newTokenOf(name)} pending={renew.isPending} onClick={() => renew.mutate()}>
            {words.newToken}
          </Act>
          <Act name={words.giveUpOf(name)} onClick={() => setAsked(true)}>
            {words.giveUp}
          </Act>
        </div>
      )}
      {asked && <Sure name={name} pending={giveUp.isPending} yes={() => giveUp.mutate()} no={() => setAsked(false)} />}
    </li>
  );
}

interface SureProps {
  readonly name: string;
  readonly pending: boolean;
  readonly yes: () => void;
  readonly no: () => void;
}

/** It can't be taken back, so it takes a second step. */
function Sure({ name, pending, yes, no }: SureProps) {
  const { home: words } = peopleTexts;
  const cancel = useRef<HTMLButtonElement>(null);
  useEffect(() => cancel.current?.focus(), []);
  return (
    <fieldset className={classes.choices}>
      <legend>{words.giveUpTitle(name)}</legend>
      <p>{words.giveUpText}</p>
      <div className={classes.actions}>
        <Button ref={cancel} mih={44} variant="default" onClick={no}>
          {words.cancel}
        </Button>
        <Button mih={44} loading={pending} onClick={yes}>
          {words.giveUpYes}
        </Button>
      </div>
    </fieldset>
  );
}

function Claim() {
  const { home: words } = peopleTexts;
  const queries = useQueryClient();
  const [code, setCode] = useState("");
  const claim = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/claims", { body: { claim_code: code.trim() } })),
    onSuccess: () => setCode(""),
    onSettled: () => queries.invalidateQueries({ queryKey: ROBOTS }),
  });
  return (
    <Form
      label={words.claim}
      submit={words.claimSubmit}
      pending={claim.isPending}
      error={claim.error}
      problems={{ 404: words.wrongCode }}
      onSubmit={() => claim.mutate()}
    >
      <Field
        label={words.code}
        required
        minLength={8}
        maxLength={40}
        autoComplete="off"
        autoCapitalize="characters"
        value={code}
        onValue={setCode}
      />
      {claim.data && <p role="status">{words.claimed(claim.data.name)}</p>}
    </Form>
  );
}
