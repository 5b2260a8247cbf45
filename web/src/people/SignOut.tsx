import { Button } from "@mantine/core";
import { useState } from "react";
import { api } from "../api/client";
import { forgetDrafts } from "../editor/forgetting";
import { texts } from "../texts";
import classes from "./People.module.css";

export function SignOut() {
  const [failed, setFailed] = useState(false);
  const signOut = async () => {
    const answer = await api.DELETE("/api/v1/session").catch(() => null);
    // A page that is loaded anew has nothing of the home in its memory.
    if (answer && (answer.response.ok || answer.response.status === 401)) {
      forgetDrafts();
      location.assign("/");
    } else setFailed(true);
  };
  return (
    <>
      <Button mih={44} variant="default" onClick={() => void signOut()}>
        {texts.signOut.label}
      </Button>
      {failed && (
        <p className={classes.trouble} role="alert">
          {texts.signOut.failed}
        </p>
      )}
    </>
  );
}
