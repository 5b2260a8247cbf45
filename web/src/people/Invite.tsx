import { type QueryKey, useMutation, useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { Choice, Field, Form } from "./parts";
import { peopleTexts } from "./texts";

interface InviteProps<As extends string, Made> {
  readonly label: string;
  readonly submit: string;
  readonly as: string;
  readonly options: Readonly<Record<As, string>>;
  readonly first: As;
  readonly problems: Readonly<Record<number, string>>;
  readonly invite: (email: string, as: As) => Promise<Made>;
  /** What is listed anew afterwards. */
  readonly queryKey: QueryKey;
  /** What is said of an invitation that was made. */
  readonly children: (made: Made, email: string) => ReactNode;
}

/** Somebody is asked in, by e-mail address, as something. */
export function Invite<As extends string, Made>(props: InviteProps<As, Made>) {
  const queries = useQueryClient();
  const [email, setEmail] = useState("");
  const [as, setAs] = useState(props.first);
  const invite = useMutation({
    mutationFn: (asked: string) => props.invite(asked, as),
    onSuccess: () => setEmail(""),
    onSettled: () => queries.invalidateQueries({ queryKey: props.queryKey }),
  });
  return (
    <Form
      label={props.label}
      submit={props.submit}
      pending={invite.isPending}
      error={invite.error}
      problems={props.problems}
      onSubmit={() => invite.mutate(email)}
    >
      <Field label={peopleTexts.email} type="email" required value={email} onValue={setEmail} />
      <Choice label={props.as} value={as} options={props.options} onValue={setAs} />
      {invite.isSuccess && props.children(invite.data, invite.variables)}
    </Form>
  );
}
