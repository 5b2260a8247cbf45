import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { Link } from "wouter";
import { answered, api, type Schemas } from "../api/client";
import { questionsQuery, refreshAll } from "../api/queries";
import { Icon } from "../icons";
import { Moment } from "../Moment";
import type { Conflict } from "../map/questions";
import { questionPath, SETTINGS_PATH } from "../paths";
import { texts } from "../texts";
import { describeConflict, fullTime } from "../words";
import classes from "./QuestionsPage.module.css";
import { Failure, Loading } from "./states";

interface QuestionsPageProps {
  readonly robots: readonly Schemas["RobotSummary"][];
}

/** What waits for an answer, and what was settled without one, of all maps. */
export default function QuestionsPage({ robots }: QuestionsPageProps) {
  const open = useQuery(questionsQuery("open"));
  const settled = useQuery(questionsQuery("resolved_automatically"));
  const failed = [open, settled].find(({ isError, data }) => isError && !data);
  if (failed) return <Failure what={texts.questions.failed} error={failed.error} retry={() => void failed.refetch()} />;
  if (!open.data || !settled.data) return <Loading />;
  const nameOf = ({ robot, map }: Conflict) => {
    const owner = robots.find(({ id }) => id === robot);
    return texts.questions.of(owner?.maps.find((one) => one.map === map)?.name ?? map, owner?.name ?? robot);
  };
  return (
    <div className={classes.page}>
      <title>{`${texts.questions.title} · ${texts.product}`}</title>
      <Link className={classes.settings} href={SETTINGS_PATH}>
        {texts.questions.settings}
      </Link>
      <h1>{texts.questions.title}</h1>
      <p className="visually-hidden" role="status">
        {texts.questions.badge(open.data.items.length)}
      </p>
      {open.data.items.length === 0 ? (
        <p className={classes.none}>{texts.questions.none}</p>
      ) : (
        <Questions conflicts={open.data.items} nameOf={nameOf} />
      )}
      {open.data.next !== null && <p className={classes.none}>{texts.questions.newest(open.data.items.length)}</p>}
      {settled.data.items.length > 0 && (
        <section aria-labelledby="settled">
          <h2 id="settled">{texts.questions.settled}</h2>
          <p className={classes.none}>{texts.questions.settledLead}</p>
          <Questions conflicts={settled.data.items} nameOf={nameOf} />
        </section>
      )}
    </div>
  );
}

interface QuestionsProps {
  readonly conflicts: readonly Conflict[];
  /** What a question's map is called, where it is not plain from the page. */
  readonly nameOf?: (conflict: Conflict) => string;
}

export function Questions({ conflicts, nameOf }: QuestionsProps) {
  return (
    <ul className={classes.questions}>
      {conflicts.map((conflict) => (
        <li key={`${conflict.robot}/${conflict.map}/${conflict.id}`} data-open={conflict.default !== null}>
          <div>
            <Link href={questionPath(conflict.robot, conflict.map, conflict.id)}>{describeConflict(conflict)}</Link>
            <p>
              {nameOf && <>{nameOf(conflict)} · </>}
              {texts.questions.opened} <Moment at={conflict.opened_at} />
              {conflict.fold_count > 0 && `, ${texts.questions.again(conflict.fold_count)}`}
            </p>
            {conflict.default && <p>{texts.questions.until(fullTime(new Date(conflict.default.at)))}</p>}
          </div>
          <Icon name="right" />
        </li>
      ))}
    </ul>
  );
}

/** Those of one map, for its own page; nothing where there are none. */
interface MapQuestionsProps {
  readonly conflicts: readonly Conflict[];
  readonly mayEdit: boolean;
}

export function MapQuestions({ conflicts, mayEdit }: MapQuestionsProps) {
  const [first] = conflicts;
  if (!first) return null;
  return (
    <section className={classes.ofMap} aria-labelledby="questions-of-map">
      <h2 id="questions-of-map">{texts.questions.here}</h2>
      <Questions conflicts={conflicts} />
      {mayEdit && conflicts.length > 1 && <AnswerAll robot={first.robot} map={first.map} />}
    </section>
  );
}

/** The recommended answer to all that is open about a map; what needs more than that stays open. */
function AnswerAll({ robot, map }: { readonly robot: string; readonly map: string }) {
  const queries = useQueryClient();
  const answer = useMutation({
    mutationFn: () =>
      answered(
        api.POST("/api/v1/robots/{robot}/maps/{map}/conflicts/decision", {
          params: { path: { robot, map } },
          body: { response: "accept", dividers: [], note: "" },
        }),
      ),
    onSettled: () => refreshAll(queries),
  });
  return (
    <>
      <Button className={classes.all ?? ""} mih={44} loading={answer.isPending} onClick={() => answer.mutate()}>
        {texts.questions.all}
      </Button>
      {answer.error && <p role="alert">{answer.error.message}</p>}
    </>
  );
}
