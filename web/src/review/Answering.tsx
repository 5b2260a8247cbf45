import { lazy, type ReactNode, Suspense, useEffect, useMemo, useState } from "react";
import pageClasses from "../pages/MapPage.module.css";
import { Loading } from "../pages/states";
import { NOTHING, type Selection } from "../viewer/MapCanvas";
import { fullTime } from "../words";
import { AnswerList } from "./AnswerList";
import type { Situation } from "./answers";
import { Facts } from "./Facts";
import classes from "./Review.module.css";
import type { ReviewProps } from "./ReviewPage";
import { Stage } from "./Stage";
import { carried } from "./stage";
import { reviewTexts } from "./texts";

// Drawing is for those who want another boundary than those that are offered.
const Drawing = lazy(() => import("./Drawing"));

interface AnsweringProps extends ReviewProps {
  readonly situation: Situation;
  readonly heading: ReactNode;
  readonly onRefused: () => void;
  /** How it ended, where it did: there is nothing to answer then. */
  readonly ended: ReactNode;
}

/** A question about a map: the picture beside the words and the answers. */
export function Answering(props: AnsweringProps) {
  const { conflict, sensed, before, head, title, situation, heading, ended } = props;
  const here = useMemo(() => carried(before, sensed.moved), [before, sensed.moved]);
  const [selection, setSelection] = useState<Selection>(() => ({ room: worstOf(conflict), centre: false }));
  const [drawing, setDrawing] = useState(false);
  const [shown, setShown] = useState<string | null>(null);
  const isOver = ended !== null;
  useEffect(() => {
    if (isOver) setShown(null);
  }, [isOver]);
  const result = useMemo(
    () => (isOver && sensed.moved_now !== null ? carried(head, sensed.moved_now) : null),
    [isOver, head, sensed.moved_now],
  );
  const canDraw = ended === null && sensed.moved !== null && DRAWABLE.has(conflict.kind);

  if (drawing && canDraw) {
    return (
      <Suspense fallback={<Loading />}>
        <Drawing {...props} here={here} onDone={() => setDrawing(false)} />
      </Suspense>
    );
  }
  return (
    <div className={`${pageClasses.page} ${classes.page}`}>
      <div className={pageClasses.map}>
        <Stage
          title={title}
          conflict={conflict}
          sensed={sensed}
          here={here}
          result={result}
          shown={shown}
          onShow={setShown}
          selection={ended === null ? selection : NOTHING}
          onSelect={(room) => setSelection({ room, centre: false })}
        />
      </div>
      <aside className={pageClasses.panel}>
        {heading}
        {ended ?? (
          <AnswerList
            conflict={conflict}
            situation={situation}
            head={head}
            onDraw={canDraw ? () => setDrawing(true) : null}
            onShow={setShown}
            onRefused={props.onRefused}
          >
            <Standing {...props} />
          </AnswerList>
        )}
        <Facts
          conflict={conflict}
          sensed={sensed}
          here={here}
          selected={selection.room}
          onSelect={(room) => setSelection({ room, centre: true })}
        />
      </aside>
    </div>
  );
}

const DRAWABLE: ReadonlySet<string> = new Set(["room_lost", "room_recall", "room_precision", "shape", "connectivity"]);

/** The room to look at first. */
function worstOf({ rooms }: ReviewProps["conflict"]): string | null {
  return [...rooms].sort((a, b) => a.recall - b.recall || a.precision - b.precision)[0]?.id ?? null;
}

/** What happens by itself. */
export function Standing({ conflict }: { readonly conflict: ReviewProps["conflict"] }) {
  const { default: standing, fold_count: again } = conflict;
  return (
    <p className={classes.standing}>
      {standing ? reviewTexts.deadline(fullTime(new Date(standing.at))) : reviewTexts.settled}
      {again > 0 && ` ${reviewTexts.again(again)}`}
    </p>
  );
}
