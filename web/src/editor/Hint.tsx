import { useSyncExternalStore } from "react";
import type { DrawingState } from "./DrawingState";
import classes from "./Editor.module.css";
import type { Tool } from "./targets";
import { editorTexts } from "./texts";

interface HintProps {
  readonly drawing: DrawingState;
  readonly tool: Tool;
  /** What to say in place of that; whoever hears the page is told it elsewhere. */
  readonly instead?: string | null;
}

/** What to do next, and what would come of it. */
export function Hint({ drawing, tool, instead = null }: HintProps) {
  const { parts, first } = useSyncExternalStore(drawing.subscribe, drawing.get);
  const said = parts.map(({ room, areas }) => editorTexts.toBe(room, areas)).join(". ");
  return (
    <p className={classes.hint} aria-live={instead === null ? "polite" : "off"}>
      {instead ?? (said || (first ? editorTexts.second : editorTexts.hint[tool]))}
    </p>
  );
}
