import { Button, useComputedColorScheme } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo, useRef } from "react";
import { Link } from "wouter";
import { conflictQuery, versionQuery } from "../api/queries";
import { Icon } from "../icons";
import { Moment } from "../Moment";
import { byMission, type Mission, onRobotSince, type Version } from "../map/history";
import { viewMap } from "../map/view";
import { questionPath } from "../paths";
import { texts } from "../texts";
import { useSeen } from "../useSeen";
import { describeConflict, describeMission, describeScore, isUnchanged, madeBy } from "../words";
import classes from "./HistoryPanel.module.css";
import { Failure, Loading } from "./states";
import { Thumbnail } from "./Thumbnail";
import type { History } from "./useHistory";
import { VersionActions } from "./VersionActions";

interface HistoryPanelProps {
  readonly history: History;
  readonly shown: number;
  readonly newest: number;
  readonly pinned: number | null;
  readonly mayEdit: boolean;
  readonly onChoose: (version: number | null) => void;
  readonly onCompare: (before: number, after: number) => void;
}

export default function HistoryPanel(props: HistoryPanelProps) {
  const { history, shown, newest, pinned, mayEdit, onChoose, onCompare } = props;
  if (history.isPending) return <Loading />;
  if (history.error && history.entries.length === 0) {
    return <Failure what={texts.history.failed} error={history.error} retry={history.retry} />;
  }
  return (
    <>
      <ol className={classes.history} reversed>
        {history.entries.map((entry) =>
          entry.kind === "version" ? (
            <VersionEntry
              key={`version ${entry.version.version}`}
              version={entry.version}
              mission={entry.mission}
              isShown={entry.version.version === shown}
              isNewest={entry.version.version === newest}
              newest={newest}
              pinned={pinned}
              mayEdit={mayEdit}
              missions={history.missions}
              onCompare={onCompare}
              onNewest={() => onChoose(null)}
              onChoose={() => onChoose(entry.version.version === newest ? null : entry.version.version)}
            />
          ) : (
            <MissionEntry key={`mission ${entry.mission.id}`} mission={entry.mission} />
          ),
        )}
      </ol>
      {history.hasMore && (
        <Button
          variant="default"
          className={classes.more ?? ""}
          loading={history.isReadingMore}
          onClick={history.readMore}
        >
          {texts.history.earlier}
        </Button>
      )}
    </>
  );
}

interface VersionEntryProps {
  readonly version: Version;
  readonly mission: Mission | null;
  readonly isShown: boolean;
  readonly isNewest: boolean;
  readonly newest: number;
  readonly pinned: number | null;
  readonly mayEdit: boolean;
  readonly missions: readonly Mission[];
  readonly onChoose: () => void;
  readonly onCompare: (before: number, after: number) => void;
  readonly onNewest: () => void;
}

function VersionEntry(props: VersionEntryProps) {
  const { version, mission, isShown, isNewest, pinned, missions, onChoose } = props;
  const outcome = mission ? describeMission(mission) : texts.history.cause[version.cause];
  return (
    <li className={classes.entry} data-shown={isShown}>
      <button type="button" className={classes.choose} aria-pressed={isShown} onClick={onChoose}>
        <span className={classes.number}>{texts.history.version(version.version)}</span>
        <span className={classes.marks}>
          {isNewest && <span className={classes.inForce}>{texts.history.inForce}</span>}
          {isNewest && pinned !== null && (
            <span className={classes.inForce}>
              <Icon name="pin" size={12} /> {texts.history.pinned}
            </span>
          )}
        </span>
        {version.name !== null && <span className={classes.named}>{version.name}</span>}
        <span className={classes.what}>{outcome}</span>
        <span className={classes.who}>
          {madeBy(version.made_by)}
          {byMission(version) && version.mission !== null && `, ${texts.history.mission(version.mission)}`},{" "}
          <Moment at={version.created_at} />
        </span>
        <Picture version={version} />
      </button>
      {isShown && mission && <MissionDetails mission={mission} />}
      {isShown && !byMission(version) && <OnRobot version={version} missions={missions} />}
      {isShown && <VersionActions {...props} />}
    </li>
  );
}

/** Whether the robot has what a person changed: it takes a version along when it sets out. */
function OnRobot({ version, missions }: { readonly version: Version; readonly missions: readonly Mission[] }) {
  const since = onRobotSince(version.version, missions);
  return <p className={classes.details}>{since === null ? texts.history.notOnRobot : texts.history.onRobot(since)}</p>;
}

function Picture({ version }: { readonly version: Version }) {
  const place = useRef<HTMLSpanElement>(null);
  const seen = useSeen(place);
  const scheme = useComputedColorScheme("light");
  const found = useQuery({ ...versionQuery(version.robot, version.map, version.version), enabled: seen });
  const view = useMemo(() => found.data && viewMap(found.data), [found.data]);
  return (
    <span ref={place} className={classes.picture} aria-hidden="true">
      {view && <Thumbnail view={view} scheme={scheme} label={texts.history.picture(version.version)} />}
    </span>
  );
}

function MissionEntry({ mission }: { readonly mission: Mission }) {
  return (
    <li className={classes.entry} data-outcome={mission.outcome ?? mission.status}>
      <div className={classes.aside}>
        <span className={classes.what}>{describeMission(mission)}</span>
        <span className={classes.who}>
          {texts.history.mission(mission.id)}, <Moment at={mission.received_at} />
        </span>
      </div>
      <MissionDetails mission={mission} />
    </li>
  );
}

/** Why, in a sentence, and what happened to which room. */
function MissionDetails({ mission }: { readonly mission: Mission }) {
  const changed = mission.rooms.filter((room) => !isUnchanged(room));
  return (
    <div className={classes.details}>
      {mission.reason && <p>{mission.reason}</p>}
      {changed.length > 0 && (
        <>
          <p className={classes.scores}>{texts.history.scores}</p>
          <ul>
            {changed.map((room) => (
              <li key={room.id} data-passed={room.passed}>
                <strong>{room.name}</strong>: {describeScore(room)}
              </li>
            ))}
          </ul>
        </>
      )}
      {mission.conflicts.map((conflict) => (
        <Asked key={conflict} robot={mission.robot} map={mission.map} conflict={conflict} />
      ))}
      {mission.warnings.map((warning) => (
        <p key={warning} className={classes.warning}>
          {warning}
        </p>
      ))}
    </div>
  );
}

interface AskedProps {
  readonly robot: string;
  readonly map: string;
  readonly conflict: string;
}

/** A question that the mission met, and how it ended. */
function Asked({ robot, map, conflict }: AskedProps) {
  const place = useRef<HTMLParagraphElement>(null);
  const seen = useSeen(place);
  const found = useQuery({ ...conflictQuery(robot, map, conflict), enabled: seen });
  return (
    <p ref={place} className={classes.asked}>
      {found.data && (
        <>
          <Link href={questionPath(robot, map, conflict)}>{describeConflict(found.data)}</Link>{" "}
          {texts.questions.state[found.data.state]}
        </>
      )}
    </p>
  );
}
