import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api } from "../api/client";
import classes from "../people/People.module.css";
import { Trouble } from "../people/parts";
import { KINDS, type Kind, settingsQuery } from "./queries";
import { settingsTexts } from "./texts";

interface KindsProps {
  readonly way: "email" | "push";
  readonly kinds: readonly Kind[];
}

/** What is told by one of the ways; saved at once. */
export function Kinds({ way, kinds }: KindsProps) {
  const queries = useQueryClient();
  const choose = useMutation({
    mutationFn: (wanted: Kind[]) => answered(api.PATCH("/api/v1/notifications", { body: { [way]: wanted } })),
    onSuccess: (settings) => queries.setQueryData(settingsQuery.queryKey, settings),
    onSettled: () => setWanted(null),
  });
  // Shown at once, until the service has said what is so.
  const [wanted, setWanted] = useState<readonly Kind[] | null>(null);
  const shown = wanted ?? kinds;
  const set = (next: Kind[]) => {
    setWanted(next);
    choose.mutate(next);
  };
  return (
    <fieldset className={classes.choices}>
      <legend>{settingsTexts.kindsOf}</legend>
      {KINDS.map((kind) => (
        <label key={kind}>
          <input
            type="checkbox"
            checked={shown.includes(kind)}
            onChange={({ currentTarget: { checked } }) =>
              set(KINDS.filter((one) => (one === kind ? checked : shown.includes(one))))
            }
          />
          {settingsTexts.kinds[kind]}
        </label>
      ))}
      <p className="visually-hidden" role="status">
        {choose.isSuccess && settingsTexts.saved}
      </p>
      <Trouble error={choose.error} />
    </fieldset>
  );
}
