import { Button } from "@mantine/core";
import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api } from "../api/client";
import { FORGOTTEN_PATH } from "../paths";
import classes from "./People.module.css";
import { Field, Form } from "./parts";
import { waysQuery } from "./queries";
import { peopleTexts } from "./texts";

/** By password, or by the identity provider where there is one. */
export default function SignIn() {
  const { signIn: words } = peopleTexts;
  const ways = useQuery(waysQuery);
  const [email, setEmail] = useState("");
  const [password, setPassword] = useState("");
  const signIn = useMutation({
    mutationFn: () => answered(api.POST("/api/v1/session", { body: { email, password } })),
    // Nothing of whoever was here before stays in the page's memory.
    onSuccess: () => location.reload(),
  });
  const asked = new URLSearchParams(location.search);
  const refused = asked.has("uninvited") ? words.unknown : asked.has("unsure") ? words.unsure : null;
  return (
    <>
      {ways.data?.provider && (
        <>
          {refused && (
            <p className={classes.trouble} role="alert">
              {refused}
            </p>
          )}
          <Button component="a" href="/login/oidc" mih={44}>
            {words.provider(ways.data.provider)}
          </Button>
          <p>{words.or}</p>
        </>
      )}
      <Form
        label={words.title}
        submit={words.submit}
        pending={signIn.isPending}
        error={signIn.error}
        problems={{ 401: words.wrong }}
        onSubmit={() => signIn.mutate()}
      >
        <Field
          label={peopleTexts.email}
          type="email"
          autoComplete="username"
          required
          value={email}
          onValue={setEmail}
        />
        <Field
          label={peopleTexts.password}
          type="password"
          autoComplete="current-password"
          required
          value={password}
          onValue={setPassword}
        />
      </Form>
      <a href={FORGOTTEN_PATH}>{words.forgotten}</a>
    </>
  );
}
