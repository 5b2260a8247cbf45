import { Button } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo, useState } from "react";
import { diffQuery, versionQuery } from "../api/queries";
import { Moment } from "../Moment";
import type { MapDocument } from "../map/document";
import { movedDocument } from "../map/moved";
import { viewMap } from "../map/view";
import pageClasses from "../pages/MapPage.module.css";
import { Failure, Loading } from "../pages/states";
import { language, texts } from "../texts";
import { MapCanvas, NOTHING } from "../viewer/MapCanvas";
import { SwipeLayer } from "../viewer/SwipeLayer";
import swipeClasses from "../viewer/SwipeLayer.module.css";
import { describeChange, madeBy } from "../words";
import classes from "./Compare.module.css";

interface CompareProps {
  readonly robot: string;
  readonly map: string;
  readonly title: string;
  readonly before: number;
  readonly after: number;
  readonly onDone: () => void;
}

/** Two versions laid over each other, and what changed from one to the other in words. */
export default function Compare({ robot, map, title, before, after, onDone }: CompareProps) {
  const older = useQuery(versionQuery(robot, map, before));
  const newer = useQuery(versionQuery(robot, map, after));
  const diff = useQuery(diffQuery(robot, map, before, after));
  const asked = [older, newer, diff];
  const failed = asked.find(({ isError }) => isError);
  if (failed) return <Failure what={texts.compare.failed} error={failed.error} retry={() => void failed.refetch()} />;
  if (!older.data || !newer.data || !diff.data) return <Loading />;
  return (
    <div className={pageClasses.page}>
      <title>{`${texts.compare.title(before, after)} · ${texts.product}`}</title>
      <div className={pageClasses.map}>
        <Overlay title={title} older={older.data} newer={newer.data} moved={diff.data.moved as Moved} />
      </div>
      <aside className={pageClasses.panel}>
        <header className={classes.heading}>
          <h1>{texts.compare.title(before, after)}</h1>
          <dl>
            {[older.data, newer.data].map((one) => (
              <div key={one.version}>
                <dt>{texts.history.version(one.version)}</dt>
                <dd>
                  {texts.history.cause[one.cause]} {madeBy(one.made_by)}, <Moment at={one.created_at} />
                </dd>
              </div>
            ))}
          </dl>
          <Button mih={44} onClick={onDone}>
            {texts.compare.done}
          </Button>
        </header>
        <section className={classes.changes} aria-labelledby="changes">
          <h2 id="changes">{texts.compare.changes}</h2>
          {diff.data.changes.length === 0 ? (
            <p>{texts.compare.same}</p>
          ) : (
            <ul>
              {diff.data.changes.map((change) => (
                <li key={`${change.code} ${change.feature}`} data-code={change.code}>
                  {language === "en" ? change.text : describeChange(change)}
                </li>
              ))}
            </ul>
          )}
          {diff.data.moved === null && <p>{texts.compare.apart}</p>}
        </section>
      </aside>
    </div>
  );
}

type Moved = readonly [number, number, number] | null;

interface OverlayProps {
  readonly title: string;
  readonly older: MapDocument;
  readonly newer: MapDocument;
  readonly moved: Moved;
}

/** The older version on the left of the slider, the newer on the right of it; or one after the other. */
function Overlay({ title, older, newer, moved }: OverlayProps) {
  const [share, setShare] = useState(50);
  const here = useMemo(() => (moved ? movedDocument(older, moved) : older), [older, moved]);
  const [before, after] = useMemo(() => [viewMap(here), viewMap(newer)], [here, newer]);
  return (
    <MapCanvas
      title={title}
      document={newer}
      view={after}
      selection={NOTHING}
      onSelect={() => undefined}
      over={(map, hidden) => <SwipeLayer over={map} hidden={hidden} document={here} view={before} share={share} />}
    >
      <div className={swipeClasses.bar}>
        <span>{texts.history.version(older.version)}</span>
        <input
          type="range"
          aria-label={texts.compare.swipe}
          aria-valuetext={texts.compare.shown(share)}
          min={0}
          max={100}
          value={share}
          onChange={({ currentTarget }) => setShare(currentTarget.valueAsNumber)}
        />
        <span>{texts.history.version(newer.version)}</span>
        <Button mih={44} variant="default" onClick={() => setShare(share > 50 ? 0 : 100)}>
          {texts.compare.blink}
        </Button>
      </div>
    </MapCanvas>
  );
}
