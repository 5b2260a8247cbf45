import { Button, Tabs } from "@mantine/core";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { lazy, Suspense, useEffect, useMemo, useRef, useState } from "react";
import { Link, useSearchParams } from "wouter";
import { isMissing, type Schemas } from "../api/client";
import { headQuery, questionsQuery, versionQuery } from "../api/queries";
import { Icon } from "../icons";
import { isParked, ofMap } from "../map/questions";
import { viewMap } from "../map/view";
import { texts } from "../texts";
import { MapCanvas, NOTHING } from "../viewer/MapCanvas";
import classes from "./MapPage.module.css";
import { ParkedPanel } from "./ParkedPanel";
import { MapQuestions } from "./QuestionsPage";
import { ReviewSetting } from "./ReviewSetting";
import { RoomsPanel } from "./RoomsPanel";
import { Failure, Loading, Nothing, Notice } from "./states";
import { useHistory } from "./useHistory";
import { VersionBar } from "./VersionBar";

interface MapPageProps {
  readonly robot: string;
  readonly map: string;
  readonly robots: readonly Schemas["RobotSummary"][];
}

// Drawing is for those who change things: the others need not wait for it.
const Editor = lazy(() => import("../editor/Editor"));
const Compare = lazy(() => import("../compare/Compare"));
// What was before is behind a tab of its own.
const HistoryPanel = lazy(() => import("./HistoryPanel"));

export default function MapPage({ robot, map, robots }: MapPageProps) {
  const { chosen, choose, editing, edit, compared, compare, showsHistory } = usePlace();
  const head = useQuery(headQuery(robot, map));
  const newest = head.data?.version;
  const isOld = chosen !== null && chosen !== newest;
  const old = useQuery({ ...versionQuery(robot, map, chosen ?? 0), enabled: isOld, placeholderData: keepPreviousData });
  const document = isOld ? old.data : head.data;
  const view = useMemo(() => document && viewMap(document), [document]);
  const history = useHistory(robot, map);
  const questions = ofMap(useQuery(questionsQuery("open")).data?.items ?? [], robot, map);
  const [selection, setSelection] = useState(NOTHING);
  const arrival = useArrival(head.data);

  const owner = robots.find(({ id }) => id === robot);
  const summary = owner?.maps.find((one) => one.map === map);
  const title = summary?.name ?? map;
  const mayEdit = owner?.may.includes("edit") ?? true;

  const asked = isOld ? old : head;
  if (summary?.version === null) {
    return (
      <Notice title={title}>
        <p>{texts.map.noVersion}</p>
        <Link href="/">{texts.home}</Link>
        {mayEdit && <ParkedPanel robot={robot} map={map} floors={owner?.maps ?? []} />}
        <Suspense fallback={<Loading />}>
          <HistoryPanel
            history={history}
            shown={0}
            newest={0}
            pinned={null}
            mayEdit={mayEdit}
            onChoose={choose}
            onCompare={compare}
          />
        </Suspense>
      </Notice>
    );
  }
  if (asked.isError && !asked.data) {
    return isMissing(asked.error) ? (
      <Nothing text={texts.map.missing} />
    ) : (
      <Failure what={texts.map.failed} error={asked.error} retry={() => void asked.refetch()} />
    );
  }
  if (!document || !view || newest === undefined) return <Loading />;

  if (editing && mayEdit && head.data) {
    return (
      <Suspense fallback={<Loading />}>
        <Editor robot={robot} map={map} title={title} head={head.data} onDone={() => edit(false)} />
      </Suspense>
    );
  }

  if (compared) {
    const [before, after] = compared;
    return (
      <Suspense fallback={<Loading />}>
        <Compare robot={robot} map={map} title={title} before={before} after={after} onDone={() => choose(null)} />
      </Suspense>
    );
  }

  const room = view.rooms.find(({ id }) => id === selection.room);

  return (
    <div className={classes.page}>
      <title>{`${title} · ${texts.product}`}</title>
      <div className={classes.map}>
        <MapCanvas
          title={title}
          document={document}
          view={view}
          selection={selection}
          onSelect={(id) => setSelection({ room: id, centre: false })}
        >
          {arrival && <p className={classes.arrival}>{arrival}</p>}
          <VersionBar shown={document} newest={newest} numbers={history.numbers} onChoose={choose} />
        </MapCanvas>
      </div>
      <aside className={classes.panel}>
        <header className={classes.heading}>
          <Link href="/">{texts.home}</Link>
          <h1>{title}</h1>
          <p>
            {owner?.name ?? robot} · {texts.map.summary(view.rooms.length, view.area)}
          </p>
          {!isOld && mayEdit && (
            <Button
              className={classes.edit ?? ""}
              mih={44}
              leftSection={<Icon name="pencil" size={18} />}
              onClick={() => edit(true)}
            >
              {texts.map.edit}
            </Button>
          )}
        </header>
        <MapQuestions conflicts={questions.filter((one) => !isParked(one))} mayEdit={mayEdit} />
        {mayEdit && <ParkedPanel robot={robot} map={map} floors={owner?.maps ?? []} />}
        <Tabs
          defaultValue={showsHistory ? "history" : "rooms"}
          keepMounted={false}
          classNames={{ list: classes.tabs ?? "", tab: classes.tab ?? "" }}
        >
          <Tabs.List grow>
            <Tabs.Tab value="rooms">{texts.map.tabs.rooms}</Tabs.Tab>
            <Tabs.Tab value="history">{texts.map.tabs.history}</Tabs.Tab>
          </Tabs.List>
          <Tabs.Panel value="rooms">
            <RoomsPanel
              rooms={view.rooms}
              selected={selection.room}
              onSelect={(id) => setSelection({ room: id, centre: true })}
            />
            {summary && mayEdit && <ReviewSetting robot={robot} map={summary} />}
          </Tabs.Panel>
          <Tabs.Panel value="history">
            <Suspense fallback={<Loading />}>
              <HistoryPanel
                history={history}
                shown={document.version}
                newest={newest}
                pinned={summary?.pinned ?? null}
                mayEdit={mayEdit}
                onChoose={choose}
                onCompare={compare}
              />
            </Suspense>
          </Tabs.Panel>
        </Tabs>
      </aside>
      <p className="visually-hidden" role="status">
        {arrival ?? (room && texts.room.selected(room.name, room.area))}
      </p>
    </div>
  );
}

interface Place {
  /** The version in the page's address, null for the one in force. */
  readonly chosen: number | null;
  readonly choose: (version: number | null) => void;
  readonly editing: boolean;
  readonly edit: (editing: boolean) => void;
  /** Two versions to be laid over each other. */
  readonly compared: readonly [number, number] | null;
  readonly compare: (before: number, after: number) => void;
  /** Whether a link led to the history. */
  readonly showsHistory: boolean;
}

function usePlace(): Place {
  const [search, setSearch] = useSearchParams();
  const given = Number(search.get("version"));
  return {
    chosen: Number.isInteger(given) && given > 0 ? given : null,
    choose: (version) => setSearch(version === null ? {} : { version: String(version) }, { replace: true }),
    editing: search.has("edit"),
    compared: twoOf(search.get("compare")),
    showsHistory: search.has("history"),
    compare: (before, after) => setSearch({ compare: `${before}-${after}` }),
    edit: (editing) => setSearch(editing ? { edit: "" } : {}),
  };
}

function twoOf(text: string | null): readonly [number, number] | null {
  const found = /^(\d{1,9})-(\d{1,9})$/.exec(text ?? "");
  return found ? [Number(found[1]), Number(found[2])] : null;
}

const ARRIVAL_SHOWN_MS = 8_000;

/** What to say about a version that came while the page was open; for a while only. */
function useArrival(head: Schemas["MapDocument"] | undefined): string | null {
  const known = useRef<number | null>(null);
  const [arrival, setArrival] = useState<string | null>(null);
  useEffect(() => {
    if (!head) return;
    const before = known.current;
    known.current = head.version;
    if (before === null || head.version <= before) return;
    setArrival(texts.map.arrived(head.version, texts.history.cause[head.cause]));
    const timer = setTimeout(() => setArrival(null), ARRIVAL_SHOWN_MS);
    return () => clearTimeout(timer);
  }, [head]);
  return arrival;
}
