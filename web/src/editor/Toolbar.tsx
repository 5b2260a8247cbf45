import { Icon, type IconName } from "../icons";
import { type Draft, redoStep, undoStep } from "../map/draft";
import classes from "./Editor.module.css";
import type { EditSession } from "./session";
import { DRAWING_TOOLS, type Tool } from "./targets";
import { editorTexts } from "./texts";

const ICONS: Readonly<Record<Tool, IconName>> = {
  select: "cursor",
  divider: "divide",
  no_go: "noGo",
  no_mop: "noMop",
  virtual_wall: "wall",
  phantom: "ghost",
};

interface ToolbarProps {
  readonly tool: Tool;
  readonly onTool: (tool: Tool) => void;
  readonly draft: Draft;
  readonly session: EditSession;
}

export function Toolbar({ tool, onTool, draft, session }: ToolbarProps) {
  return (
    <div className={classes.toolbar} role="toolbar" aria-label={editorTexts.tools}>
      {(["select", ...DRAWING_TOOLS] as const).map((one) => (
        <button key={one} type="button" aria-pressed={tool === one} onClick={() => onTool(one)}>
          <Icon name={ICONS[one]} />
          <span>{editorTexts.tool[one]}</span>
        </button>
      ))}
      <span className={classes.gap} />
      <button type="button" disabled={undoStep(draft) === null} onClick={() => void session.undo()}>
        <Icon name="undo" />
        <span>{editorTexts.undo}</span>
      </button>
      <button type="button" disabled={redoStep(draft) === null} onClick={() => void session.redo()}>
        <Icon name="redo" />
        <span>{editorTexts.redo}</span>
      </button>
    </div>
  );
}
