import { useSyncExternalStore } from "react";
import type { DrawingState } from "./DrawingState";
import classes from "./Editor.module.css";
import type { Tool } from "./targets";
import { editorTexts } from "./texts";

interface HintProps {
  readonly drawing: DrawingState;
  readonly tool: Tool;
  /** Another division into rooms is being looked at. */
  readonly isTrying?: boolean;
}

/** What to do next, and what would come of it. */
export function Hint({ drawing, tool, isTrying = false }: HintProps) {
  const { parts, first } = useSyncExternalStore(drawing.subscribe, drawing.get);
  const said = parts.map(({ room, areas }) => editorTexts.toBe(room, areas)).join(". ");
  return (
    <p className={classes.hint} aria-live="polite">
      {isTrying ? editorTexts.sensitivity.trying : said || (first ? editorTexts.second : editorTexts.hint[tool])}
    </p>
  );
}
