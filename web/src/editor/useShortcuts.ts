import { useEffect, useRef } from "react";
import type { Tool } from "./targets";

interface Shortcuts {
  readonly onTool: (tool: Tool) => void;
  readonly onUndo: () => void;
  readonly onRedo: () => void;
  readonly onSave: () => void;
  readonly onDelete: () => void;
  readonly onEscape: () => void;
  readonly onSheet: () => void;
}

const TOOLS: Readonly<Record<string, Tool>> = {
  v: "select",
  d: "divider",
  n: "no_go",
  m: "no_mop",
  w: "virtual_wall",
  x: "phantom",
};

/** Keys work wherever the focus is, but for fields in which letters are written. */
export function useShortcuts(shortcuts: Shortcuts): void {
  const latest = useRef(shortcuts);
  latest.current = shortcuts;
  useEffect(() => {
    const pressed = (event: KeyboardEvent) => {
      const action = actionOf(event, latest.current);
      if (!action) return;
      event.preventDefault();
      action();
    };
    addEventListener("keydown", pressed);
    return () => removeEventListener("keydown", pressed);
  }, []);
}

function actionOf(event: KeyboardEvent, on: Shortcuts): (() => void) | null {
  const key = event.key.toLowerCase();
  const target = event.target instanceof HTMLElement ? event.target : null;
  const isWriting =
    target?.matches("input:not([type=checkbox], [type=radio], [type=range]), select, textarea") ?? false;
  if (target?.closest("dialog")) return null;
  if (event.ctrlKey || event.metaKey) {
    if (key === "s") return on.onSave;
    if (isWriting) return null;
    if (key === "z") return event.shiftKey ? on.onRedo : on.onUndo;
    return key === "y" ? on.onRedo : null;
  }
  if (isWriting || event.altKey) return null;
  if (key === "escape") return on.onEscape;
  if (key === "delete" || key === "backspace") return on.onDelete;
  if (key === "?") return on.onSheet;
  const tool = TOOLS[key];
  return tool ? () => on.onTool(tool) : null;
}
