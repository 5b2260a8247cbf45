import { useQuery } from "@tanstack/react-query";
import { type ReactNode, useMemo, useState } from "react";
import { Link } from "wouter";
import { isMissing, type Schemas } from "../api/client";
import { conflictQuery, headQuery, missionQuery, sensedQuery, versionQuery } from "../api/queries";
import type { MapDocument } from "../map/document";
import { type Conflict, isDiscovery, isParked } from "../map/questions";
import { ParkedQuestion } from "../pages/ParkedPanel";
import { Failure, Loading, Nothing } from "../pages/states";
import { mapPath, QUESTIONS_PATH } from "../paths";
import { texts } from "../texts";
import { describeConflict } from "../words";
import { Answering, Standing } from "./Answering";
import { AnswerList } from "./AnswerList";
import type { Situation } from "./answers";
import { Ended } from "./Ended";
import classes from "./Review.module.css";
import type { Sensed } from "./stage";
import { reviewTexts } from "./texts";

interface ReviewPageProps {
  readonly robot: string;
  readonly map: string;
  readonly conflict: string;
  readonly robots: readonly Schemas["RobotSummary"][];
}

/** One question: what the robot saw, what that would change, and what can be answered. */
export default function ReviewPage({ robot, map, conflict: key, robots }: ReviewPageProps) {
  const conflict = useQuery(conflictQuery(robot, map, key));
  const head = useQuery(headQuery(robot, map));
  const sensed = useQuery(sensedQuery(robot, map, key));
  const before = useQuery({
    ...versionQuery(robot, map, sensed.data?.base_version ?? 0),
    enabled: sensed.data !== undefined,
  });
  const asked = [conflict, head, sensed, before];
  const failed = asked.find(({ isError, data }) => isError && !data);
  if (failed) {
    return isMissing(failed.error) ? (
      <Nothing text={reviewTexts.missing} />
    ) : (
      <Failure what={reviewTexts.failed} error={failed.error} retry={() => void failed.refetch()} />
    );
  }
  if (!conflict.data || !head.data || !sensed.data || !before.data) return <Loading />;
  const owner = robots.find(({ id }) => id === robot);
  const title = owner?.maps.find((one) => one.map === map)?.name ?? map;
  return (
    <Review
      conflict={conflict.data}
      head={head.data}
      sensed={sensed.data}
      before={before.data}
      title={title}
      floors={owner?.maps ?? []}
      mayAnswer={owner?.may.includes("edit") ?? true}
    />
  );
}

export interface ReviewProps {
  readonly conflict: Conflict;
  /** The version in force. */
  readonly head: MapDocument;
  readonly sensed: Sensed;
  /** The version that the mission carried over. */
  readonly before: MapDocument;
  readonly title: string;
}

interface Situated {
  readonly floors: readonly Schemas["MapSummary"][];
  /** Viewers of a home look, and are asked nothing. */
  readonly mayAnswer: boolean;
}

function Review(props: ReviewProps & Situated) {
  const { conflict, head, title, mayAnswer } = props;
  const asked = useAsked(conflict, head);
  const situation = useMemo(() => situationOf(conflict, asked, props.sensed), [conflict, asked, props.sensed]);
  const [refused, setRefused] = useState(false);
  const onRefused = () => setRefused(true);
  const isOver = conflict.decided_by !== null;
  const heading = (
    <header className={classes.heading}>
      <nav>
        <Link href={QUESTIONS_PATH}>{reviewTexts.questions}</Link>
        <Link href={mapPath(conflict.robot, conflict.map)}>{title}</Link>
      </nav>
      <h1>{isParked(conflict) ? texts.parked.title : describeConflict(conflict)}</h1>
    </header>
  );
  return (
    <>
      <title>{`${reviewTexts.question}: ${title} · ${texts.product}`}</title>
      {isParked(conflict) ? (
        <Parked {...props} heading={heading} onRefused={onRefused} />
      ) : (
        <Answering
          {...props}
          situation={situation}
          heading={heading}
          onRefused={onRefused}
          ended={
            isOver ? (
              <Ended conflict={conflict} head={head} situation={situation} late={refused} />
            ) : mayAnswer ? null : (
              <p>{reviewTexts.onlyLook}</p>
            )
          }
        />
      )}
    </>
  );
}

/** The map that the question was about when it was answered: an answer may end what it speaks of. */
function useAsked({ robot, map, version }: Conflict, head: MapDocument): MapDocument {
  const made = useQuery({ ...versionQuery(robot, map, version ?? 0), enabled: version !== null });
  const parent = made.data?.cause === "decision" ? made.data.parent : null;
  const asked = useQuery({ ...versionQuery(robot, map, parent ?? 0), enabled: parent !== null });
  return asked.data ?? head;
}

/** A mission that is not of this floor, or of none that is known: it is answered by saying which. */
function Parked({
  conflict,
  head,
  floors,
  mayAnswer,
  heading,
  onRefused,
}: ReviewProps &
  Situated & {
    readonly heading: ReactNode;
    readonly onRefused: () => void;
  }) {
  const mission = useQuery(missionQuery(conflict.robot, conflict.map, conflict.mission));
  return (
    <div className={classes.parked}>
      {heading}
      {conflict.decided_by !== null && <Ended conflict={conflict} head={head} situation={NOTHING_KNOWN} late={false} />}
      {conflict.decided_by === null && !mayAnswer && <p>{reviewTexts.onlyLook}</p>}
      {conflict.decided_by === null && mayAnswer && mission.data && (
        <ParkedQuestion mission={mission.data} floors={floors} others={0} titled={false} onPlaced={() => undefined} />
      )}
      {conflict.decided_by === null && mayAnswer && (
        <AnswerList
          conflict={conflict}
          situation={NOTHING_KNOWN}
          head={head}
          onDraw={null}
          onShow={() => undefined}
          onRefused={onRefused}
        >
          <Standing conflict={conflict} />
        </AnswerList>
      )}
      {mission.data && (
        <img className={classes.seen} src={mission.data.grid} alt={texts.parked.picture(mission.data.id)} />
      )}
    </div>
  );
}

const NOTHING_KNOWN: Situation = { taken: false, ways: [], neighbour: null };

function situationOf(conflict: Conflict, head: MapDocument, { taken }: Sensed): Situation {
  const about = head.features.filter(({ id }) => conflict.dividers.includes(id));
  const own = new Set(conflict.rooms.map(({ id }) => id));
  const beside = about.flatMap(({ properties }) => ("rooms" in properties ? properties.rooms : []));
  return {
    taken,
    ways: about.filter(
      (feature): feature is Situation["ways"][number] =>
        feature.properties.semantic === "divider" && feature.properties.kind === "open",
    ),
    neighbour: isDiscovery(conflict) ? (beside.find((id) => !own.has(id)) ?? null) : null,
  };
}
