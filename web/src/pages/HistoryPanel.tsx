import { Button } from "@mantine/core";
import { Moment } from "../Moment";
import { byMission, type Mission, type Version } from "../map/history";
import { texts } from "../texts";
import { describeMission, describeScore, isUnchanged, madeBy } from "../words";
import classes from "./HistoryPanel.module.css";
import { Failure, Loading } from "./states";
import type { History } from "./useHistory";

interface HistoryPanelProps {
  readonly history: History;
  readonly shown: number;
  readonly newest: number;
  readonly onChoose: (version: number | null) => void;
}

export function HistoryPanel({ history, shown, newest, onChoose }: HistoryPanelProps) {
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
  readonly onChoose: () => void;
}

function VersionEntry({ version, mission, isShown, isNewest, onChoose }: VersionEntryProps) {
  const outcome = mission ? describeMission(mission) : texts.history.cause[version.cause];
  return (
    <li className={classes.entry} data-shown={isShown}>
      <button type="button" className={classes.choose} aria-pressed={isShown} onClick={onChoose}>
        <span className={classes.number}>{texts.history.version(version.version)}</span>
        {isNewest && <span className={classes.inForce}>{texts.history.inForce}</span>}
        <span className={classes.what}>{outcome}</span>
        <span className={classes.who}>
          {madeBy(version.made_by)}
          {byMission(version) && version.mission !== null && `, ${texts.history.mission(version.mission)}`},{" "}
          <Moment at={version.created_at} />
        </span>
      </button>
      {isShown && mission && <MissionDetails mission={mission} />}
    </li>
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
      {mission.warnings.map((warning) => (
        <p key={warning} className={classes.warning}>
          {warning}
        </p>
      ))}
    </div>
  );
}
