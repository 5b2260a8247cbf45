import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api, type Schemas } from "../api/client";
import { refreshAll } from "../api/queries";
import { texts } from "../texts";
import classes from "./ReviewSetting.module.css";

interface ReviewSettingProps {
  readonly robot: string;
  readonly map: Schemas["MapSummary"];
}

/** Whether stillroom decides by itself about this map, or asks first. */
export function ReviewSetting({ robot, map }: ReviewSettingProps) {
  const queries = useQueryClient();
  const set = useMutation({
    mutationFn: (review: Schemas["MapSummary"]["review"]) =>
      answered(
        api.PATCH("/api/v1/robots/{robot}/maps/{map}", { params: { path: { robot, map: map.map } }, body: { review } }),
      ),
    onSettled: () => refreshAll(queries).then(() => setWanted(null)),
  });
  // Shown at once, until the service has said what is so.
  const [wanted, setWanted] = useState<Schemas["MapSummary"]["review"] | null>(null);
  const shown = wanted ?? map.review;
  const choose = (review: Schemas["MapSummary"]["review"]) => {
    setWanted(review);
    set.mutate(review);
  };
  return (
    <fieldset className={classes.setting}>
      <legend>{texts.questions.review}</legend>
      {(["automatic", "ask_first"] as const).map((one) => (
        <label key={one}>
          <input type="radio" name="review" checked={shown === one} onChange={() => choose(one)} />
          {one === "automatic" ? texts.questions.automatic : texts.questions.askFirst}
        </label>
      ))}
      {set.isError && (
        <p role="alert">
          {texts.questions.reviewFailed} {set.error.message}
        </p>
      )}
    </fieldset>
  );
}
