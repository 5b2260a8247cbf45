import { Button } from "@mantine/core";
import { useEffect, useRef } from "react";
import classes from "./Editor.module.css";
import { editorTexts } from "./texts";

export function ShortcutSheet({ onClose }: { readonly onClose: () => void }) {
  const sheet = useRef<HTMLDialogElement>(null);
  useEffect(() => sheet.current?.showModal(), []);
  return (
    <dialog ref={sheet} className={classes.sheet} aria-labelledby="shortcuts-title" onClose={onClose}>
      <h2 id="shortcuts-title">{editorTexts.keys}</h2>
      <dl>
        {editorTexts.shortcuts.map(([keys, what]) => (
          <div key={keys}>
            <dt>
              <kbd>{keys}</kbd>
            </dt>
            <dd>{what}</dd>
          </div>
        ))}
      </dl>
      <Button mih={44} onClick={() => sheet.current?.close()}>
        {editorTexts.close}
      </Button>
    </dialog>
  );
}
