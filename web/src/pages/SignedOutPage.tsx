import { Button } from "@mantine/core";
import { texts } from "../texts";
import { Command, Notice } from "./states";

export function SignedOutPage({ look }: { readonly look: () => void }) {
  const { signedOut } = texts;
  return (
    <Notice title={signedOut.title}>
      <p>{signedOut.lead}</p>
      <p>{signedOut.start}</p>
      <Command>stillroom serve</Command>
      <p>{signedOut.again}</p>
      <Command>stillroom login-link</Command>
      <p>{signedOut.once}</p>
      <Button size="md" onClick={look}>
        {signedOut.check}
      </Button>
    </Notice>
  );
}
