import { Button } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { lazy, Suspense, useEffect } from "react";
import { answered, api } from "../api/client";
import { texts } from "../texts";
import { Command, Notice } from "./states";
import classes from "./states.module.css";

const SignIn = lazy(() => import("../people/SignIn"));

export function SignedOutPage({ look }: { readonly look: () => void }) {
  const { signedOut } = texts;
  const ways = useQuery({
    queryKey: ["sign-in"],
    queryFn: ({ signal }) => answered(api.GET("/api/v1/sign-in", { signal })),
  });
  useEffect(() => {
    // Whoever opens a sign-in link is sent on to where they wanted to go.
    if (location.pathname === "/") return;
    const wanted = encodeURIComponent(location.pathname + location.search);
    // biome-ignore lint/suspicious/noDocumentCookie: the Cookie Store API is not in all browsers yet
    document.cookie = `stillroom_next=${wanted}; path=/login; max-age=86400; samesite=lax`;
  }, []);
  return (
    <Notice title={signedOut.title}>
      <p>{signedOut.lead}</p>
      <Suspense>
        <SignIn />
      </Suspense>
      {/* Where no letters are sent, links come from the machine that runs the service. */}
      {ways.data && (
        <details className={classes.others} open={!ways.data.mail}>
          <summary>{signedOut.byLink}</summary>
          <p>{signedOut.start}</p>
          <Command>stillroom serve</Command>
          <p>{signedOut.again}</p>
          <Command>stillroom login-link</Command>
          <p>
            {signedOut.once} {location.pathname !== "/" && signedOut.back}
          </p>
          <Button size="md" onClick={look}>
            {signedOut.check}
          </Button>
        </details>
      )}
    </Notice>
  );
}
