import { Button } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo, useState } from "react";
import { useLocation, useSearch } from "wouter";
import { Failure, Loading } from "../pages/states";
import { texts } from "../texts";
import { CauseList } from "./CauseList";
import { FilterBar } from "./FilterBar";
import filterBarClasses from "./FilterBar.module.css";
import classes from "./Fleet.module.css";
import { day, whole } from "./figures";
import { every, searchOf } from "./filters";
import { causesPath } from "./paths";
import { type CauseState, causesQuery, STATES } from "./queries";
import { fleetTexts } from "./texts";
import { useFilters } from "./useFilters";

const A_PAGE = 20;

/** What missions failed by, in groups. */
export function CausesPage() {
  const { filters } = useFilters();
  const [shown, setShown] = useState(A_PAGE);
  const [, go] = useLocation();
  const wanted = new URLSearchParams(useSearch()).get("state");
  const state = STATES.find((one) => one === wanted) ?? null;
  const { data, error, isError, refetch } = useQuery(causesQuery(filters, state));
  const days = useMemo(() => (data ? every("day", data.first, data.last) : []), [data]);
  const { cause: words } = fleetTexts;
  const show = (one: CauseState | null, changed = filters) => {
    const search = searchOf(changed);
    go(causesPath(one === null ? search : [search, `state=${one}`].filter(Boolean).join("&")));
  };
  if (isError && !data) return <Failure what={fleetTexts.failed} error={error} retry={() => void refetch()} />;
  return (
    <>
      <title>{`${fleetTexts.causes} · ${texts.product}`}</title>
      <h1>{words.title}</h1>
      <p className={classes.lead}>{words.lead}</p>
      <FilterBar filters={filters} change={(changed) => show(state, { ...filters, ...changed })} />
      <fieldset className={filterBarClasses.spans}>
        <legend>{words.states}</legend>
        {[null, ...STATES].map((one) => (
          <label key={one ?? "any"} data-on={state === one}>
            <input
              type="radio"
              name="state"
              className="visually-hidden"
              checked={state === one}
              onChange={() => show(one)}
            />
            {one === null ? words.any : words.state[one]}
          </label>
        ))}
      </fieldset>
      {!data && <Loading />}
      {data && (
        <>
          <p className={classes.counts} aria-live="polite">
            {day(data.first)}
            {data.last !== data.first && ` – ${day(data.last)}`}: {whole(data.missions)} {words.failedInAll}
          </p>
          {data.items.length === 0 ? (
            <p>{words.none}</p>
          ) : (
            <>
              <CauseList causes={data.items.slice(0, shown)} days={days} search={searchOf(filters)} />
              {data.items.length > shown && (
                <Button variant="default" size="md" onClick={() => setShown(shown + A_PAGE)}>
                  {fleetTexts.missions.more}
                </Button>
              )}
            </>
          )}
        </>
      )}
    </>
  );
}
