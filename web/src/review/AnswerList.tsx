import { Button } from "@mantine/core";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, type ReactNode, useEffect, useId, useRef, useState } from "react";
import { Link, useSearchParams } from "wouter";
import { conflictQuery, refreshAll } from "../api/queries";
import type { MapDocument } from "../map/document";
import { type Conflict, isDiscovery, isParked } from "../map/questions";
import { mapPath, QUESTIONS_PATH } from "../paths";
import { listed } from "../words";
import { type Answer, answersTo, type Situation } from "./answers";
import { decide, editInForce, isLost } from "./calls";
import classes from "./Review.module.css";
import { reviewTexts } from "./texts";

interface AnswerListProps {
  readonly conflict: Conflict;
  readonly situation: Situation;
  readonly head: MapDocument;
  /** Null where there is nothing to draw. */
  readonly onDraw: (() => void) | null;
  readonly onShow: (proposal: string) => void;
  /** Called where an answer was refused: another one may have come first. */
  readonly onRefused: () => void;
  /** What happens without an answer. */
  readonly children: ReactNode;
}

const MOST_TRIES = 5;
const FIRST_WAIT_MS = 500;

/** Each answer is one tap; what it does is written on it. */
export function AnswerList({ conflict, situation, head, onDraw, onShow, onRefused, children }: AnswerListProps) {
  const queries = useQueryClient();
  const [search] = useSearchParams();
  const headingId = useId();
  const answers = answersTo(conflict, situation);
  const picked = answers.find(({ key }) => key === search.get("answer"))?.key ?? null;
  const answer = useMutation({
    mutationFn: async ({ edit, ...rest }: Answer) => {
      if (edit) await editInForce(conflict.robot, conflict.map, head.version, edit);
      return decide(conflict, { edit, ...rest });
    },
    retry: (failures, error) => failures < MOST_TRIES && isLost(error),
    retryDelay: (failures) => FIRST_WAIT_MS * 2 ** failures,
    onSuccess: (ended) => {
      queries.setQueryData(conflictQuery(conflict.robot, conflict.map, conflict.id).queryKey, ended);
    },
    onError: onRefused,
    onSettled: () => refreshAll(queries),
  });
  // The likeliest answer is to name a new room, or to say which floor it is.
  const isElsewhere = isDiscovery(conflict) || isParked(conflict);
  const nameOf = (id: string) => roomName(id, head, conflict);
  const lost = conflict.rooms.filter(({ recall }) => recall === 0).map(({ id }) => nameOf(id));
  const send = (one: Answer) => {
    // Two taps before the page is drawn again are one.
    if (!answer.isPending && !sent.current) answer.mutate(one, { onSettled: () => (sent.current = false) });
    sent.current = true;
  };
  const sent = useRef(false);
  return (
    <section className={classes.answers} aria-labelledby={headingId}>
      <h2 id={headingId}>{isParked(conflict) ? reviewTexts.otherwise : reviewTexts.answers}</h2>
      {isDiscovery(conflict) && <Naming conflict={conflict} busy={answer.isPending} onName={send} />}
      <ul>
        {answers.map((one, k) => (
          <AnswerButton
            key={one.key}
            answer={one}
            hint={
              one.saying === "takeNew" && lost.length > 0
                ? reviewTexts.lost(listed(lost))
                : reviewTexts.hint[one.saying]
            }
            label={reviewTexts.answer[one.saying](listed(one.about.map(nameOf)), one.about.length)}
            isFirst={picked === null ? k === 0 && !isElsewhere : one.key === picked}
            isPicked={one.key === picked}
            isBusy={answer.isPending}
            isSent={answer.isPending && answer.variables.key === one.key}
            onAnswer={() => send(one)}
            onLook={() => one.proposal !== null && onShow(one.proposal)}
          />
        ))}
      </ul>
      <Progress answer={answer} />
      <div className={classes.others}>
        {conflict.kind === "restriction_unplaced" && (
          <Link className={classes.other} href={`${mapPath(conflict.robot, conflict.map)}?edit`}>
            {reviewTexts.redraw}
          </Link>
        )}
        {onDraw && (
          <Button mih={44} variant="default" disabled={answer.isPending} onClick={onDraw}>
            {reviewTexts.draw}
          </Button>
        )}
        <Link className={classes.other} href={QUESTIONS_PATH}>
          {reviewTexts.later}
        </Link>
      </div>
      {children}
    </section>
  );
}

interface AnswerButtonProps {
  readonly answer: Answer;
  readonly label: string;
  readonly hint: string;
  readonly isFirst: boolean;
  readonly isPicked: boolean;
  readonly isBusy: boolean;
  readonly isSent: boolean;
  readonly onAnswer: () => void;
  readonly onLook: () => void;
}

function AnswerButton({ answer, label, hint, isFirst, isPicked, isBusy, isSent, onAnswer, onLook }: AnswerButtonProps) {
  const hintId = useId();
  const button = useRef<HTMLButtonElement>(null);
  useEffect(() => {
    if (isPicked) button.current?.focus();
  }, [isPicked]);
  return (
    <li>
      <Button
        ref={button}
        variant={isFirst ? "filled" : "default"}
        className={classes.answer ?? ""}
        fullWidth
        loading={isSent}
        disabled={isBusy && !isSent}
        aria-describedby={hintId}
        onClick={onAnswer}
        onFocus={onLook}
      >
        <span>
          {label}
          {answer.recommended && <span className={classes.recommended}>{reviewTexts.recommended}</span>}
        </span>
      </Button>
      <p id={hintId} className={classes.hint}>
        {isPicked && <strong>{reviewTexts.picked} </strong>}
        {hint}
      </p>
    </li>
  );
}

interface ProgressProps {
  readonly answer: {
    readonly isPending: boolean;
    readonly isPaused: boolean;
    readonly failureCount: number;
    readonly error: Error | null;
  };
}

export function Progress({ answer }: ProgressProps) {
  const said = answer.isPaused
    ? reviewTexts.waiting
    : answer.failureCount > 0
      ? reviewTexts.trying
      : reviewTexts.sending;
  return (
    <>
      <p className={answer.isPending ? classes.progress : "visually-hidden"} role="status">
        {answer.isPending ? said : ""}
      </p>
      {answer.error && (
        <p className={classes.refused} role="alert">
          {answer.error.message}
        </p>
      )}
    </>
  );
}

interface NamingProps {
  readonly conflict: Conflict;
  readonly busy: boolean;
  readonly onName: (answer: Answer) => void;
}

/** A name says at once that it is a room of its own. */
function Naming({ conflict, busy, onName }: NamingProps) {
  const fieldId = useId();
  const [name, setName] = useState("");
  const room = conflict.rooms[0];
  const own = conflict.proposals.find(({ action }) => action !== "keep_previous");
  if (!room || !own) return null;
  const submit = (event: FormEvent) => {
    event.preventDefault();
    onName({
      key: "name",
      response: "accept",
      proposal: own.id,
      edit: { op: "rename_room", id: room.id, at: null, name: name.trim() },
      saying: "ownRoom",
      about: [room.id],
      recommended: false,
    });
  };
  return (
    <form className={classes.naming} onSubmit={submit}>
      <label htmlFor={fieldId}>{reviewTexts.name}</label>
      <input
        id={fieldId}
        required
        maxLength={64}
        pattern=".*\S.*"
        autoComplete="off"
        value={name}
        onChange={({ currentTarget }) => setName(currentTarget.value)}
      />
      <Button type="submit" mih={44} disabled={busy}>
        {reviewTexts.setName}
      </Button>
    </form>
  );
}

/** As it is called now. */
export function roomName(id: string, head: MapDocument, conflict: Conflict): string {
  const found = head.features.find((feature) => feature.id === id)?.properties;
  if (found?.semantic === "room") return found.name;
  return conflict.rooms.find((room) => room.id === id)?.name ?? "";
}
