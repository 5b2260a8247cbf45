import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { answered, api } from "../api/client";
import { Choice, Form } from "../people/parts";
import { privacyTexts as words } from "./texts";

const KEY = ["home", "retention"];
const ALWAYS = 0;
const DAYS = [ALWAYS, 30, 90, 180, 365, 730];

/** How long what robots sensed is kept, and what that comes to. */
export function Retention() {
  const queries = useQueryClient();
  const kept = useQuery({
    queryKey: KEY,
    queryFn: ({ signal }) => answered(api.GET("/api/v1/home/retention", { signal })),
  });
  const [picked, setPicked] = useState<number | null>(null);
  const days = picked ?? kept.data?.days ?? ALWAYS;
  const would = useQuery({
    queryKey: [...KEY, days],
    enabled: days !== ALWAYS,
    queryFn: ({ signal }) => answered(put(days, true, signal)),
  });
  const choose = useMutation({
    mutationFn: () => answered(put(days, false)),
    onSettled: () => queries.invalidateQueries({ queryKey: KEY }),
  });
  if (!kept.data) return null;
  const known = DAYS.includes(days) ? DAYS : [...DAYS, days];
  const options = Object.fromEntries(known.map((one) => [String(one), words.days(one)]));
  return (
    <Form
      label={words.keep}
      submit={words.choose}
      pending={choose.isPending}
      error={choose.error}
      onSubmit={choose.mutate}
    >
      <Choice label={words.keep} value={String(days)} options={options} onValue={(value) => setPicked(Number(value))} />
      <p role="status">
        {words.effect(days, kept.data.newest)} {days !== ALWAYS && would.data && words.now(would.data.missions)}
      </p>
    </Form>
  );
}

function put(days: number, dryRun: boolean, signal?: AbortSignal) {
  return api.PUT("/api/v1/home/retention", {
    params: { query: { dry_run: dryRun } },
    body: { days: days === ALWAYS ? null : days },
    ...(signal ? { signal } : {}),
  });
}
