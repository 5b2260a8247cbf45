import { Button } from "@mantine/core";
import { useEffect } from "react";
import { texts } from "../texts";
import { Command, Notice } from "./states";

export function SignedOutPage({ look }: { readonly look: () => void }) {
  const { signedOut } = texts;
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
    </Notice>
  );
}
