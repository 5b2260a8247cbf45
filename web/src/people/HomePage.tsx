import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { answered, api, type Schemas } from "../api/client";
import { robotsQuery } from "../api/queries";
import { Failure, Loading } from "../pages/states";
import { PrivacySection } from "../privacy/PrivacySection";
import { texts } from "../texts";
import { Invite } from "./Invite";
import { OwnRobots } from "./OwnRobots";
import classes from "./People.module.css";
import { Act, Choice, Section, Trouble } from "./parts";
import { done, householdQuery, type Role, waysQuery } from "./queries";
import { peopleTexts } from "./texts";

type Household = Schemas["Household"];

/** Who may see the maps of one's robots, and which robots are one's own. */
export function HomePage({ email }: { readonly email: string }) {
  const { home: words } = peopleTexts;
  const household = useQuery({ ...householdQuery, refetchOnMount: "always" });
  const ways = useQuery(waysQuery);
  if (household.isError && !household.data) {
    return <Failure what={peopleTexts.failed} error={household.error} retry={() => void household.refetch()} />;
  }
  if (!household.data || !ways.data) return <Loading />;
  return (
    <>
      <title>{`${words.title} · ${texts.product}`}</title>
      <h1>{words.title}</h1>
      <p>{words.lead}</p>
      <OwnRobots email={email} />
      <People household={household.data} mail={ways.data.mail} />
      {household.data.homes.length > 0 && <Others homes={household.data.homes} />}
      <PrivacySection email={email} />
    </>
  );
}

/** Of a member, in a home of one's own or of another's. */
function useParting() {
  const queries = useQueryClient();
  return useMutation({
    mutationFn: (member: string) =>
      done(api.DELETE("/api/v1/household/people/{member}", { params: { path: { member } } })),
    onSettled: () =>
      Promise.all(
        [householdQuery.queryKey, robotsQuery.queryKey].map((queryKey) => queries.invalidateQueries({ queryKey })),
      ),
  });
}

function People({ household, mail }: { readonly household: Household; readonly mail: boolean }) {
  const { home: words } = peopleTexts;
  const queries = useQueryClient();
  const settle = { onSettled: () => queries.invalidateQueries({ queryKey: householdQuery.queryKey }) };
  const change = useMutation({
    mutationFn: ({ member, role }: { readonly member: string; readonly role: Role }) =>
      answered(api.PATCH("/api/v1/household/people/{member}", { params: { path: { member } }, body: { role } })),
    ...settle,
  });
  const withdraw = useMutation({
    mutationFn: (invitation: string) =>
      done(api.DELETE("/api/v1/household/invitations/{invitation}", { params: { path: { invitation } } })),
    ...settle,
  });
  const part = useParting();
  const { people, invitations } = household;
  return (
    <Section title={words.people}>
      {people.length + invitations.length === 0 && <p>{words.nobody}</p>}
      <ul className={classes.list}>
        {people.map(({ id, email, role }) => (
          <li key={id}>
            <p>
              <strong>{email}</strong>
            </p>
            <div className={classes.actions}>
              <Choice
                bare
                label={words.roleOf(email)}
                value={role}
                options={words.role}
                onValue={(wanted) => change.mutate({ member: id, role: wanted })}
              />
              <Act name={words.removeOf(email)} onClick={() => part.mutate(id)}>
                {words.remove}
              </Act>
            </div>
          </li>
        ))}
        {invitations.map(({ id, email, role }) => (
          <li key={id}>
            <p>
              <strong>{email}</strong> {role && words.role[role]}
            </p>
            <p className={classes.soft}>{words.invited}</p>
            <Act name={words.withdrawOf(email)} onClick={() => withdraw.mutate(id)}>
              {words.withdraw}
            </Act>
          </li>
        ))}
      </ul>
      <Trouble error={change.error ?? withdraw.error ?? part.error} />
      <h3>{words.invite}</h3>
      {mail ? <InviteHome /> : <p>{words.noMail}</p>}
    </Section>
  );
}

function InviteHome() {
  const { home: words } = peopleTexts;
  return (
    <Invite<Role, Household>
      label={words.invite}
      submit={words.send}
      as={words.asRole}
      options={words.role}
      first="member"
      problems={{ 409: words.already, 422: words.notInvited }}
      invite={(email, role) => answered(api.POST("/api/v1/household/invitations", { body: { email, role } }))}
      queryKey={householdQuery.queryKey}
    >
      {(_, email) => <p role="status">{words.sent(email)}</p>}
    </Invite>
  );
}

function Others({ homes }: { readonly homes: Household["homes"] }) {
  const { home: words } = peopleTexts;
  const part = useParting();
  return (
    <Section title={words.others}>
      <ul className={classes.list}>
        {homes.map(({ id, home, role }) => (
          <li key={id}>
            <p>
              <strong>{home}</strong> {words.role[role]}
            </p>
            <Act name={words.leaveOf(home)} onClick={() => part.mutate(id)}>
              {words.leave}
            </Act>
          </li>
        ))}
      </ul>
      <Trouble error={part.error} />
    </Section>
  );
}
