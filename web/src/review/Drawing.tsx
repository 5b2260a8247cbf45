import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useId, useMemo, useRef, useState } from "react";
import { conflictQuery, proposalQuery, refreshAll } from "../api/queries";
import { DrawingState } from "../editor/DrawingState";
import type { EditLayerEvents } from "../editor/EditLayer";
import { SplitForm } from "../editor/forms";
import { Hint } from "../editor/Hint";
import { barriers } from "../editor/targets";
import { editorTexts } from "../editor/texts";
import { useEditLayer } from "../editor/useEditLayer";
import type { DividerFeature, MapDocument } from "../map/document";
import type { Line } from "../map/operations";
import { attach } from "../map/snap";
import { type MapView, viewMap } from "../map/view";
import pageClasses from "../pages/MapPage.module.css";
import { area } from "../texts";
import type { HomeMap } from "../viewer/HomeMap";
import { MapCanvas, NOTHING } from "../viewer/MapCanvas";
import { Progress } from "./AnswerList";
import { decideWithLines, isLost, previewLines } from "./calls";
import classes from "./Review.module.css";
import type { ReviewProps } from "./ReviewPage";
import { focusOf, proposedDocument, scene, shownProposals } from "./stage";
import { reviewTexts } from "./texts";

interface DrawingProps extends ReviewProps {
  /** The map before, in the mission's frame. */
  readonly here: MapDocument;
  readonly onRefused: () => void;
  readonly onDone: () => void;
}

interface Refusal {
  readonly text: string;
  readonly extended: Line | null;
}

const MOST_TRIES = 3;

/** Answers a question with boundaries of one's own: drawn on what the robot saw, tried by the service, then decided. */
export default function Drawing({ conflict, sensed, title, here, onRefused, onDone }: DrawingProps) {
  const queries = useQueryClient();
  const base = useBase({ conflict, sensed, here });
  const [lines, setLines] = useState<readonly Line[]>([]);
  const [refusal, setRefusal] = useState<Refusal | null>(null);
  const [homeMap, setHomeMap] = useState<HomeMap | null>(null);
  const [drawing] = useState(() => new DrawingState());
  const drawn = useMemo(() => ({ ...base, features: [...base.features, ...lines.map(asDivider)] }), [base, lines]);

  const tried = useQuery({
    queryKey: ["drawn", conflict.robot, conflict.map, conflict.id, conflict.mission, lines],
    queryFn: ({ signal }) => previewLines(conflict, lines, signal),
    enabled: lines.length > 0,
    retry: (failures, error) => failures < MOST_TRIES && isLost(error),
  });
  const decide = useMutation({
    mutationFn: () => decideWithLines(conflict, lines),
    retry: (failures, error) => failures < MOST_TRIES && isLost(error),
    onSuccess: (ended) => {
      queries.setQueryData(conflictQuery(conflict.robot, conflict.map, conflict.id).queryKey, ended);
    },
    onError: onRefused,
    onSettled: () => refreshAll(queries),
  });

  const put = (next: readonly Line[]) => {
    setRefusal(null);
    decide.reset();
    setLines(next);
  };
  /** Its ends are found here at once; an end in mid-air is refused where it was drawn. */
  const add = (line: Line) => {
    const found = attach(line, barriers(drawn));
    if (found.ok) put([...lines, found.line]);
    else {
      const text = found.gap > 0 ? editorTexts.adrift(found.gap) : editorTexts.nothing;
      setRefusal({ text, extended: found.extended });
    }
  };
  const events: EditLayerEvents = {
    onPick: () => undefined,
    onDraw: (_, from, to) => add([from, to]),
    onMove: () => undefined,
    onParts: (parts) => drawing.set({ parts }),
    onFirst: (first) => drawing.set({ first }),
  };
  const cancel = useEditLayer(homeMap, { document: drawn, tool: "divider", selection: null }, events);

  const heading = useRef<HTMLHeadingElement>(null);
  useEffect(() => heading.current?.focus({ preventScroll: true }), []);

  const preview = tried.data?.ok ? tried.data.document : null;
  const focus = useMemo(() => focusOf(conflict, [here, base], sensed), [conflict, here, base, sensed]);
  const shown = useMemo(() => {
    const { document, view } = scene(preview ?? base, { focus, sensed });
    return { document, view: { ...view, proposed: lines.map(asDivider) } };
  }, [preview, base, focus, sensed, lines]);
  const { drawing: words } = reviewTexts;

  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: Escape starts a line anew wherever the focus is
    <div className={`${pageClasses.page} ${classes.page}`} onKeyDown={({ key }) => key === "Escape" && cancel()}>
      <div className={pageClasses.map}>
        <MapCanvas
          title={title}
          document={shown.document}
          view={shown.view}
          selection={NOTHING}
          onSelect={() => undefined}
          onMap={setHomeMap}
        >
          <Hint drawing={drawing} tool="divider" />
        </MapCanvas>
      </div>
      <aside className={pageClasses.panel}>
        <div className={classes.drawing}>
          <h1 ref={heading} tabIndex={-1}>
            {words.title}
          </h1>
          <p>{words.lead}</p>
          {refusal && <Refused refusal={refusal} onExtend={(line) => put([...lines, line])} />}
          <Lines lines={lines} faulty={tried.data?.ok === false ? tried.data.lines : []} onChange={put} />
          <p role="status">
            {lines.length > 0 && tried.isPending && words.checking}
            {preview && words.comesTo(viewMap(preview).rooms.map((room) => `${room.name} ${area(room.area)}`))}
          </p>
          {tried.data?.ok === false && (
            <p className={classes.refused} role="alert">
              <strong>{words.refused}:</strong> {tried.data.reason}
            </p>
          )}
          {tried.error && (
            <p className={classes.refused} role="alert">
              {tried.error.message}
            </p>
          )}
          <div className={classes.others}>
            <Button mih={44} disabled={!preview} loading={decide.isPending} onClick={() => decide.mutate()}>
              {words.use}
            </Button>
            <Button mih={44} variant="default" disabled={decide.isPending} onClick={onDone}>
              {words.cancel}
            </Button>
          </div>
          <Progress answer={decide} />
          <ByRoom view={shown.view} onDivider={add} />
        </div>
      </aside>
    </div>
  );
}

/** What is drawn on: the map that the robot's picture gives, if there is one. */
function useBase({ conflict, sensed, here }: Pick<DrawingProps, "conflict" | "sensed" | "here">): MapDocument {
  const proposals = shownProposals(conflict);
  const asSeen = proposals.find(({ action }) => action === "take_new") ?? proposals[0];
  const found = useQuery({
    ...proposalQuery(conflict.robot, conflict.map, conflict.id, asSeen?.id ?? ""),
    enabled: asSeen !== undefined,
  });
  return useMemo(
    () => (found.data ? proposedDocument(found.data, conflict, sensed) : here),
    [found.data, conflict, sensed, here],
  );
}

function asDivider([from, to]: Line, k: number): DividerFeature {
  return {
    type: "Feature",
    id: `drawn-${k}`,
    geometry: { type: "LineString", coordinates: [[...from], [...to]] },
    properties: { semantic: "divider", kind: "open", made_by: "user", rooms: [] },
  };
}

function Refused({ refusal, onExtend }: { readonly refusal: Refusal; readonly onExtend: (line: Line) => void }) {
  const { extended } = refusal;
  return (
    <div className={classes.refused} role="alert">
      <p>{refusal.text}</p>
      {extended && (
        <Button mih={44} onClick={() => onExtend(extended)}>
          {reviewTexts.drawing.extend}
        </Button>
      )}
    </div>
  );
}

interface LinesProps {
  readonly lines: readonly Line[];
  /** Numbers of those that can't stay. */
  readonly faulty: readonly number[];
  readonly onChange: (lines: readonly Line[]) => void;
}

function Lines({ lines, faulty, onChange }: LinesProps) {
  const { drawing: words } = reviewTexts;
  return (
    <section aria-labelledby="own-lines">
      <h2 id="own-lines">{words.lines}</h2>
      {lines.length === 0 ? (
        <p>{words.none}</p>
      ) : (
        <ol>
          {lines.map((line, k) => (
            <li key={line.join()} data-faulty={faulty.includes(k)}>
              {words.line(k + 1)}
              <Button mih={36} variant="default" onClick={() => onChange(lines.filter((_, i) => i !== k))}>
                {words.remove} <span className="visually-hidden">{words.line(k + 1)}</span>
              </Button>
            </li>
          ))}
        </ol>
      )}
    </section>
  );
}

/** Divides a room without pointing at the map. */
function ByRoom({ view, onDivider }: { readonly view: MapView; readonly onDivider: (line: Line) => void }) {
  const fieldId = useId();
  const [chosen, setChosen] = useState<string | null>(null);
  const room = view.rooms.find(({ id }) => id === chosen) ?? view.rooms[0];
  if (!room) return null;
  return (
    <section className={classes.byRoom}>
      <label htmlFor={fieldId}>{reviewTexts.drawing.room}</label>
      <select id={fieldId} value={room.id} onChange={({ currentTarget }) => setChosen(currentTarget.value)}>
        {view.rooms.map(({ id, name }) => (
          <option key={id} value={id}>
            {name}
          </option>
        ))}
      </select>
      <SplitForm room={room} onDivider={onDivider} />
    </section>
  );
}
