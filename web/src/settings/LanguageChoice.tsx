import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useId } from "react";
import { answered, api } from "../api/client";
import classes from "../people/People.module.css";
import { Trouble } from "../people/parts";
import { language } from "../texts";
import { type Settings, settingsQuery } from "./queries";
import own from "./Settings.module.css";
import { settingsTexts } from "./texts";

const LANGUAGES = ["en", "de"] as const;

/** In which language messages are; until somebody chooses, that of the app where they were asked for. */
export function LanguageChoice({ chosen }: { readonly chosen: Settings["language"] }) {
  const queries = useQueryClient();
  const fieldId = useId();
  const choose = useMutation({
    mutationFn: (wanted: (typeof LANGUAGES)[number]) =>
      answered(api.PATCH("/api/v1/notifications", { body: { language: wanted } })),
    onSuccess: (settings) => queries.setQueryData(settingsQuery.queryKey, settings),
  });
  const shown = (choose.isPending ? choose.variables : chosen) ?? language;
  return (
    <div className={own.language}>
      <label htmlFor={fieldId}>{settingsTexts.language}</label>
      <select
        id={fieldId}
        className={classes.select}
        value={shown}
        onChange={({ currentTarget: { value } }) => {
          const wanted = LANGUAGES.find((one) => one === value);
          if (wanted) choose.mutate(wanted);
        }}
      >
        {LANGUAGES.map((one) => (
          <option key={one} value={one} lang={one}>
            {settingsTexts.languages[one]}
          </option>
        ))}
      </select>
      <p className="visually-hidden" role="status">
        {choose.isSuccess && settingsTexts.saved}
      </p>
      <Trouble error={choose.error} />
    </div>
  );
}
