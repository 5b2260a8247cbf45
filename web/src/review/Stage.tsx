import { useQueries } from "@tanstack/react-query";
import { useEffect, useMemo, useState } from "react";
import { proposalQuery } from "../api/queries";
import type { MapDocument } from "../map/document";
import { type Conflict, isDiscovery, isDoor } from "../map/questions";
import { viewMap } from "../map/view";
import { MapCanvas, type Selection } from "../viewer/MapCanvas";
import { SwipeLayer } from "../viewer/SwipeLayer";
import swipeClasses from "../viewer/SwipeLayer.module.css";
import classes from "./Review.module.css";
import {
  confirmedDocument,
  focusOf,
  proposedDocument,
  type Sensed,
  scene,
  seenDocument,
  shownProposals,
} from "./stage";
import { reviewTexts } from "./texts";

interface StageProps {
  readonly title: string;
  readonly conflict: Conflict;
  readonly sensed: Sensed;
  /** The map before, in the mission's frame. */
  readonly here: MapDocument;
  /** What came of it, in the mission's frame, once it has ended. */
  readonly result: MapDocument | null;
  /** The proposal to look at, null: the first. */
  readonly shown: string | null;
  readonly onShow: (proposal: string) => void;
  readonly selection: Selection;
  readonly onSelect: (room: string | null) => void;
}

const [SEEN, RESULT] = ["seen", "result"];

/** The map before and each map that there could be, by toggle and by swipe. */
export function Stage({ title, conflict, sensed, here, result, shown, onShow, selection, onSelect }: StageProps) {
  const proposals = useMemo(() => shownProposals(conflict), [conflict]);
  const asked = useQueries({
    queries: proposals.map(({ id }) => proposalQuery(conflict.robot, conflict.map, conflict.id, id)),
  });
  const [share, setShare] = useState(0);
  const isOver = result !== null;
  useEffect(() => {
    if (isOver) setShare(0);
  }, [isOver]);
  const known = [
    ...(result ? [{ id: RESULT, proposal: undefined, document: result }] : []),
    ...proposals.flatMap((proposal, k) => {
      const document = asked[k]?.data;
      return document ? [{ id: proposal.id, proposal, document: proposedDocument(document, conflict, sensed) }] : [];
    }),
  ];
  const chosen = known.find(({ id }) => id === shown) ?? (shown === SEEN ? undefined : known[0]);
  const document = chosen?.document ?? null;
  const focus = useMemo(
    () => focusOf(conflict, document ? [here, document] : [here], sensed),
    [conflict, here, document, sensed],
  );
  const left = useMemo(() => scene(confirmedDocument(here, sensed), { focus, sensed }), [here, focus, sensed]);
  const right = useMemo(
    () =>
      document
        ? scene(document, { focus, sensed, proposal: chosen?.proposal })
        : scene(seenDocument(here, sensed), { focus, sensed, bounds: viewMap(here).bounds }),
    [document, focus, sensed, chosen?.proposal, here],
  );
  const isPending = asked.some((one) => one.isPending);
  const options = [
    ...(result ? [{ id: RESULT, label: reviewTexts.view.now }] : []),
    ...proposals
      .map((proposal) => ({ id: proposal.id, label: nameOf(proposal.action, conflict, sensed) }))
      .filter(({ label }) => !result || label !== reviewTexts.view.now),
    { id: SEEN, label: reviewTexts.view.seen },
  ];
  const showing = chosen?.id ?? SEEN;
  const show = (id: string) => {
    onShow(id);
    setShare(0);
  };
  if (isPending && proposals.length > 0) return <div className={classes.pending} role="status" />;
  return (
    <MapCanvas
      title={title}
      document={right.document}
      view={right.view}
      selection={selection}
      onSelect={onSelect}
      over={(map, hidden) => (
        <SwipeLayer over={map} hidden={hidden} document={left.document} view={left.view} share={share} />
      )}
    >
      <fieldset className={`${swipeClasses.bar} ${classes.bar}`} aria-label={reviewTexts.view.label}>
        <button type="button" aria-pressed={share === 100} onClick={() => setShare(100)}>
          {sensed.confirmed.length > 0 ? reviewTexts.view.confirmed : reviewTexts.view.before}
        </button>
        <input
          type="range"
          aria-label={reviewTexts.view.swipe}
          aria-valuetext={reviewTexts.view.share(share)}
          min={0}
          max={100}
          value={100 - share}
          onChange={({ currentTarget }) => setShare(100 - currentTarget.valueAsNumber)}
        />
        {options.map(({ id, label }) => (
          <button key={id} type="button" aria-pressed={share < 100 && id === showing} onClick={() => show(id)}>
            {label}
          </button>
        ))}
      </fieldset>
      {sensed.moved === null && <p className={classes.apart}>{reviewTexts.apart}</p>}
    </MapCanvas>
  );
}

function nameOf(action: Conflict["proposals"][number]["action"], conflict: Conflict, { taken }: Sensed): string {
  const { view } = reviewTexts;
  if (isDiscovery(conflict)) return action === "take_new" ? view.own : view.joined;
  if (isDoor(conflict) && taken) return action === "take_new" ? view.door : view.now;
  if (taken && conflict.default !== null) {
    const isContradicted = conflict.kind === "connectivity";
    return isContradicted && action === "take_new" ? view.joined : view.now;
  }
  return view[action];
}
