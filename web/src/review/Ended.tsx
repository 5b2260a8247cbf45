import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useRef } from "react";
import { Link } from "wouter";
import { answered, api } from "../api/client";
import { missionQuery, questionsQuery, refreshAll, versionQuery } from "../api/queries";
import { Moment } from "../Moment";
import type { MapDocument } from "../map/document";
import type { Conflict } from "../map/questions";
import { mapPath, questionPath } from "../paths";
import { describeConflict, listed, madeBy } from "../words";
import { roomName } from "./AnswerList";
import { answersTo, type Situation } from "./answers";
import classes from "./Review.module.css";
import { reviewTexts } from "./texts";

interface EndedProps {
  readonly conflict: Conflict;
  readonly head: MapDocument;
  readonly situation: Situation;
  /** Whether an answer was given here that came too late. */
  readonly late: boolean;
}

/** How a question ended, what came of it, how to take that back, and where to go on. */
export function Ended({ conflict, head, situation, late }: EndedProps) {
  const { ended } = reviewTexts;
  const heading = useRef<HTMLHeadingElement>(null);
  // The buttons that had the focus are gone: whoever listens goes on here.
  useEffect(() => heading.current?.focus(), []);
  const { state } = conflict;
  if (state === "open" || state === "resolved_automatically") return null;
  return (
    <section className={classes.ended} data-state={state} aria-live="polite">
      <h2 ref={heading} tabIndex={-1}>
        {ended[state]}
      </h2>
      {late && conflict.response !== null && <p>{reviewTexts.late}</p>}
      <What conflict={conflict} head={head} situation={situation} />
      {conflict.response !== null && conflict.decided_by !== null && conflict.decided_at !== null && (
        <p>
          {ended.by(madeBy(conflict.decided_by))}, <Moment at={conflict.decided_at} />
        </p>
      )}
      {conflict.note && (
        <p>
          {ended.note}: {conflict.note}
        </p>
      )}
      {state === "superseded" && <Replacement conflict={conflict} />}
      <Result conflict={conflict} head={head} />
      <NextQuestion conflict={conflict} />
    </section>
  );
}

/** What was answered, in the words of the buttons. */
function What({ conflict, head, situation }: Omit<EndedProps, "late">) {
  const { ended, answer } = reviewTexts;
  const { state, superseded_by: by, response } = conflict;
  if (state === "expired") return <p>{ended.kept}</p>;
  if (state === "superseded") {
    return <p>{by === null || by === conflict.mission ? ended.together : ended.pointless(by)}</p>;
  }
  const key = response === "accept" ? `accept:${conflict.proposal}` : response;
  const given = answersTo(conflict, situation).find((one) => one.key === key);
  const said =
    given && answer[given.saying](listed(given.about.map((id) => roomName(id, head, conflict))), given.about.length);
  if (said) return <p className={classes.said}>{said}</p>;
  return response === "reject" ? <p className={classes.said}>{ended.kept}</p> : null;
}

/** The question that the later mission asks instead. */
function Replacement({ conflict }: { readonly conflict: Conflict }) {
  const by = conflict.superseded_by;
  const open = useQuery(questionsQuery("open"));
  const mission = useQuery({
    ...missionQuery(conflict.robot, conflict.map, by ?? ""),
    enabled: by !== null && by !== conflict.mission,
  });
  const met = new Set(mission.data?.conflicts ?? []);
  const found = (open.data?.items ?? []).filter(
    (one) => one.robot === conflict.robot && one.map === conflict.map && met.has(one.id),
  );
  const rooms = new Set(conflict.rooms.map(({ id }) => id));
  const nearest = found.find((one) => one.rooms.some(({ id }) => rooms.has(id))) ?? found[0];
  if (!nearest) return null;
  return (
    <p>
      {reviewTexts.ended.replaced}:{" "}
      <Link href={questionPath(nearest.robot, nearest.map, nearest.id)}>{describeConflict(nearest)}</Link>
    </p>
  );
}

/** The version that came of it, and the way back. */
function Result({ conflict, head }: { readonly conflict: Conflict; readonly head: MapDocument }) {
  const { ended } = reviewTexts;
  const queries = useQueryClient();
  const { robot, map, version } = conflict;
  const made = useQuery({ ...versionQuery(robot, map, version ?? 0), enabled: version !== null });
  const undo = useMutation({
    mutationFn: (parent: number) =>
      answered(
        api.POST("/api/v1/robots/{robot}/maps/{map}/versions/{version}/restore", {
          params: { path: { robot, map, version: parent } },
        }),
      ),
    onSettled: () => refreshAll(queries),
  });
  // A decision without a version leaves the one before in force.
  const own = made.data?.cause === "decision" && made.data.created_at === conflict.decided_at ? made.data : null;
  const { parent } = own ?? { parent: null };
  return (
    <>
      {conflict.response !== null && made.data && !undo.data && <p>{own ? ended.version(own.version) : ended.same}</p>}
      {undo.data && <p role="status">{ended.undone(undo.data.version)}</p>}
      {undo.error && <p role="alert">{undo.error.message}</p>}
      <div className={classes.others}>
        {own && parent !== null && head.version === own.version && !undo.data && (
          <Button mih={44} variant="default" loading={undo.isPending} onClick={() => undo.mutate(parent)}>
            {ended.undo}
          </Button>
        )}
        <Link className={classes.other} href={`${mapPath(robot, map)}?history`}>
          {ended.history}
        </Link>
      </div>
    </>
  );
}

/** Another one of the same map, else of any. */
function NextQuestion({ conflict }: { readonly conflict: Conflict }) {
  const open = useQuery(questionsQuery("open"));
  if (!open.data) return null;
  const others = open.data.items.filter(
    (one) => one.robot !== conflict.robot || one.map !== conflict.map || one.id !== conflict.id,
  );
  const next = others.find((one) => one.robot === conflict.robot && one.map === conflict.map) ?? others[0];
  if (!next) return <p>{reviewTexts.ended.none}</p>;
  return (
    <p className={classes.next}>
      {reviewTexts.ended.next}: <Link href={questionPath(next.robot, next.map, next.id)}>{describeConflict(next)}</Link>
    </p>
  );
}
