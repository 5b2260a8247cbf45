import { useMutation, useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api, type Schemas } from "../api/client";
import { Loading, Notice } from "../pages/states";
import { texts } from "../texts";
import classes from "./People.module.css";
import { Field, Form } from "./parts";
import { done, waysQuery } from "./queries";
import { peopleTexts } from "./texts";

/** For who forgot the password. */
export function ForgottenPage() {
  const { forgotten: words } = peopleTexts;
  const ways = useQuery(waysQuery);
  const [email, setEmail] = useState("");
  const ask = useMutation({ mutationFn: () => done(api.POST("/api/v1/password-resets", { body: { email } })) });
  if (!ways.data) return <Loading />;
  return (
    <div className={`${classes.page} ${classes.narrow}`}>
      <title>{`${words.title} · ${texts.product}`}</title>
      <h1>{words.title}</h1>
      {!ways.data.mail && <p>{words.noMail}</p>}
      {ways.data.mail && ask.isSuccess && <p role="status">{words.sent}</p>}
      {ways.data.mail && !ask.isSuccess && (
        <>
          <p>{words.lead}</p>
          <Form submit={words.send} pending={ask.isPending} error={ask.error} onSubmit={() => ask.mutate()}>
            <Field
              label={peopleTexts.email}
              type="email"
              autoComplete="username"
              required
              value={email}
              onValue={setEmail}
            />
          </Form>
        </>
      )}
      <p>
        <a href="/">{words.back}</a>
      </p>
    </div>
  );
}

/** Where links of letters lead: their secret stands behind the #, which browsers send to nobody. */
export function LinkPage() {
  const { link: words } = peopleTexts;
  const [token] = useState(() => location.hash.slice(1));
  const link = useQuery({
    queryKey: ["link", token],
    gcTime: 0,
    queryFn: () => answered(api.POST("/api/v1/links/look", { body: { token } })),
    enabled: token !== "",
  });
  if (link.isPending && token) return <Loading />;
  if (!link.data) {
    return (
      <Notice title={words.gone}>
        <p>{words.goneText}</p>
        <a href="/">{texts.notFound.back}</a>
      </Notice>
    );
  }
  return <OpenLink token={token} link={link.data} />;
}

function OpenLink({ token, link }: { readonly token: string; readonly link: Schemas["LinkDocument"] }) {
  const { link: words } = peopleTexts;
  const [password, setPassword] = useState("");
  const email = link.email ?? "";
  const use = useMutation({
    mutationFn: () =>
      answered(api.POST("/api/v1/links/use", { body: { token, password: link.needs_password ? password : null } })),
    onSuccess: ({ signed_in }) => signed_in && location.assign("/"),
  });
  if (use.data && !use.data.signed_in) {
    return (
      <Notice title={words.done}>
        <p>{words.doneText}</p>
        <a href="/">{words.go}</a>
      </Notice>
    );
  }
  const title =
    link.purpose === "reset" ? words.reset(email) : link.home ? words.home(link.home) : words.account(email);
  return (
    <div className={`${classes.page} ${classes.narrow}`}>
      <title>{`${title} · ${texts.product}`}</title>
      <h1>{title}</h1>
      {link.role && <p>{words.homeAs[link.role]}</p>}
      {link.duty && <p>{words.duty[link.duty]}</p>}
      {link.purpose === "invitation" && <p>{link.needs_password ? words.choose : words.joins(email)}</p>}
      <Form
        submit={link.purpose === "reset" ? words.set : words.accept}
        pending={use.isPending}
        error={use.error}
        problems={{ 404: words.gone, 422: peopleTexts.weak }}
        onSubmit={() => use.mutate()}
      >
        {link.needs_password && (
          <>
            <input type="email" autoComplete="username" value={email} readOnly hidden />
            <Field
              label={link.purpose === "reset" ? peopleTexts.newPassword : peopleTexts.password}
              hint={peopleTexts.passwordHint}
              type="password"
              autoComplete="new-password"
              minLength={12}
              required
              value={password}
              onValue={setPassword}
            />
          </>
        )}
      </Form>
    </div>
  );
}
