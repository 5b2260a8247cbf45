import { Button } from "@mantine/core";
import { useQueryClient } from "@tanstack/react-query";
import { useCallback, useEffect, useMemo, useRef, useState, useSyncExternalStore } from "react";
import { headQuery, robotsQuery } from "../api/queries";
import type { MapDocument, Position } from "../map/document";
import { isDirty } from "../map/draft";
import * as edits from "../map/operations";
import { attach } from "../map/snap";
import { viewMap } from "../map/view";
import pageClasses from "../pages/MapPage.module.css";
import { useHistory } from "../pages/useHistory";
import { texts } from "../texts";
import type { HomeMap } from "../viewer/HomeMap";
import { MapCanvas, NOTHING, type Selection as RoomSelection } from "../viewer/MapCanvas";
import { DrawingState } from "./DrawingState";
import type { EditLayerEvents } from "./EditLayer";
import classes from "./Editor.module.css";
import { EditPanel } from "./EditPanel";
import { Hint } from "./Hint";
import { openKeeper } from "./keeping";
import { idOf } from "./keys";
import { hintOf, SensitivityPanel } from "./SensitivityPanel";
import { ShortcutSheet } from "./ShortcutSheet";
import { isUntouched } from "./sensitivity";
import { EditSession } from "./session";
import { Toolbar } from "./Toolbar";
import { barriers, rectangle, type Selection, type ShapeChange, shapeOf, type Tool } from "./targets";
import { editorTexts } from "./texts";
import { useEditLayer } from "./useEditLayer";
import { useSensitivity } from "./useSensitivity";
import { useShortcuts } from "./useShortcuts";

interface EditorProps {
  readonly robot: string;
  readonly map: string;
  readonly title: string;
  readonly head: MapDocument;
  readonly onDone: () => void;
}

/** The map page while it is being edited. */
export default function Editor(props: EditorProps) {
  const session = useSession(props);
  if (!session) return null;
  return <Editing {...props} session={session} />;
}

function useSession({ robot, map, head }: EditorProps): EditSession | null {
  const queries = useQueryClient();
  const [session, setSession] = useState<EditSession | null>(null);
  const newest = useRef(head);
  newest.current = head;
  useEffect(() => {
    let made: EditSession | null = null;
    let ended = false;
    void openKeeper(robot, map).then((keeper) => {
      if (ended) {
        keeper.release();
        return;
      }
      made = new EditSession({ robot, map }, newest.current, keeper, (document) => {
        queries.setQueryData(headQuery(robot, map).queryKey, (known) =>
          known && known.version > document.version ? known : document,
        );
        void queries.invalidateQueries({ queryKey: robotsQuery.queryKey });
      });
      setSession(made);
    });
    return () => {
      ended = true;
      made?.close();
      setSession(null);
    };
  }, [robot, map, queries]);
  useEffect(() => session?.headArrived(head), [session, head]);
  return session;
}

function Editing({ robot, map, title, onDone, session }: EditorProps & { readonly session: EditSession }) {
  const state = useSyncExternalStore(session.subscribe, session.get);
  const { document, made, keys } = state;
  const sensitivity = useSensitivity({ robot, map }, state, session);
  const shown = sensitivity.document ?? document;
  const view = useMemo(() => viewMap(shown), [shown]);
  const [chosen, setChosen] = useState<Tool>("select");
  const tool = sensitivity.isTrying ? "select" : chosen;
  const [picked, setPicked] = useState<{ readonly sort: NonNullable<Selection>["sort"]; readonly key: string } | null>(
    null,
  );
  const pickedId = picked && idOf(picked.key, keys);
  const selection = useMemo(
    () => (sensitivity.isTrying || !picked || pickedId === null ? null : { sort: picked.sort, id: pickedId }),
    [sensitivity.isTrying, picked, pickedId],
  );
  const [drawing] = useState(() => new DrawingState());
  const [homeMap, setHomeMap] = useState<HomeMap | null>(null);
  const [sheet, setSheet] = useState(false);
  const history = useHistory(robot, map);

  const setTool = (wanted: Tool) => {
    sensitivity.leave();
    setChosen(wanted);
  };

  const select = (what: Selection) => setPicked(what && { sort: what.sort, key: keys.get(what.id) ?? what.id });

  const refOf = useCallback(
    (id: string): edits.Ref => {
      const index = edits.indexOfMade(made, id);
      return index === null ? { id } : { index };
    },
    [made],
  );

  const draw = (with_: Tool, from: Position, to: Position) => {
    if (with_ === "divider") drawDivider([from, to]);
    else if (with_ === "phantom") void session.attempt((o) => edits.markPhantom(o, rectangle(from, to)));
    else if (with_ === "virtual_wall") void session.attempt((o) => edits.addRestriction(o, with_, [from, to]));
    else if (with_ !== "select") void session.attempt((o) => edits.addRestriction(o, with_, rectangle(from, to)));
  };

  /** Its ends are found here at once; an end in mid-air is refused where it was drawn. */
  const drawDivider = (line: edits.Line) => {
    const found = attach(line, barriers(document));
    if (found.ok) {
      void session.attempt((o) => edits.addDivider(o, found.line));
      return;
    }
    const { extended } = found;
    session.refuse(
      found.gap > 0 ? editorTexts.adrift(found.gap) : editorTexts.nothing,
      extended ? [{ title: "extend to wall", take: edits.addDivider(state.draft.present.operations, extended) }] : [],
    );
  };

  /** Worked out when its turn comes, from where the thing is by then: keys are pressed faster than the service answers. */
  const move = (what: NonNullable<Selection>, change: ShapeChange) => {
    void session.attempt((operations) => {
      const now = session.get();
      const shape = shapeOf(now.document, what);
      if (!shape) return operations;
      const index = edits.indexOfMade(now.made, what.id);
      const ref: edits.Ref = index === null ? { id: what.id } : { index };
      const [from, to] = change(shape);
      if (what.sort === "restriction") return edits.moveRestriction(operations, ref, change(shape));
      return from && to ? edits.moveDivider(operations, ref, [from, to]) : operations;
    });
  };

  const remove = (what: NonNullable<Selection>) => {
    const ref = refOf(what.id);
    const action = {
      divider: (o: edits.Operations) => edits.removeDivider(o, ref),
      restriction: (o: edits.Operations) => edits.removeRestriction(o, ref),
      phantom: (o: edits.Operations) => edits.removePhantom(o, ref),
    }[what.sort as string];
    if (!action) return;
    void session.attempt(action).then((ok) => ok && select(null));
  };

  const events: EditLayerEvents = {
    onPick: (what) => !sensitivity.isTrying && select(what),
    onDraw: draw,
    onMove: move,
    onParts: (parts) => drawing.set({ parts }),
    onFirst: (first) => drawing.set({ first }),
  };
  const cancel = useEditLayer(homeMap, { document: shown, tool, selection }, events);

  useShortcuts({
    onTool: setTool,
    onUndo: session.undo,
    onRedo: session.redo,
    onSave: session.save,
    onDelete: () => selection && remove(selection),
    onEscape: () => {
      if (sensitivity.isTrying) sensitivity.leave();
      else if (!cancel()) select(null);
    },
    onSheet: () => setSheet(true),
  });

  const dirty = isDirty(state.draft);
  const room: RoomSelection = selection?.sort === "room" ? { room: selection.id, centre: false } : NOTHING;

  return (
    <div className={`${pageClasses.page} ${classes.page}`}>
      <title>{`${editorTexts.title(title)} · ${texts.product}`}</title>
      <div className={pageClasses.map}>
        <MapCanvas
          title={title}
          document={shown}
          view={view}
          selection={room}
          onSelect={() => undefined}
          onMap={setHomeMap}
        >
          <Hint drawing={drawing} tool={tool} instead={hintOf(sensitivity, document)} />
          <Toolbar tool={tool} onTool={setTool} draft={state.draft} session={session} />
        </MapCanvas>
      </div>
      <aside className={pageClasses.panel}>
        <header className={classes.heading}>
          <h1>{editorTexts.title(title)}</h1>
          <div className={classes.actions}>
            <Button mih={44} disabled={!dirty || state.standing === "saving"} onClick={() => void session.save()}>
              {editorTexts.save}
            </Button>
            <Button mih={44} variant="default" onClick={onDone}>
              {editorTexts.done}
            </Button>
            {dirty && (
              <Button mih={44} variant="subtle" color="gray" c="inherit" onClick={() => void session.discard()}>
                {editorTexts.discard}
              </Button>
            )}
          </div>
        </header>
        {!history.isPending && (
          <SensitivityPanel
            sensitivity={sensitivity}
            document={document}
            isNew={!history.hasMore && isUntouched(history.entries)}
          />
        )}
        <EditPanel
          state={state}
          session={session}
          view={view}
          selection={selection}
          onSelect={select}
          refOf={refOf}
          onMove={move}
          onRemove={remove}
          onDivider={drawDivider}
          missions={history.missions}
          onSheet={() => setSheet(true)}
          isTrying={sensitivity.isTrying}
        />
      </aside>
      {sheet && <ShortcutSheet onClose={() => setSheet(false)} />}
    </div>
  );
}
