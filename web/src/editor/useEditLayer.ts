import { useComputedColorScheme } from "@mantine/core";
import { useCallback, useLayoutEffect, useRef } from "react";
import type { HomeMap } from "../viewer/HomeMap";
import { type Context, EditLayer, type EditLayerEvents } from "./EditLayer";

/** Puts the editor's layer on the map. Answers with a function that gives up what is being drawn, if anything is. */
export function useEditLayer(
  homeMap: HomeMap | null,
  { document, tool, selection }: Omit<Context, "scheme">,
  events: EditLayerEvents,
): () => boolean {
  const scheme = useComputedColorScheme("light", { getInitialValueInEffect: false });
  const layer = useRef<EditLayer | null>(null);
  const latest = useRef(events);
  latest.current = events;

  useLayoutEffect(() => {
    if (!homeMap) return;
    homeMap.picks = false;
    const made = new EditLayer(homeMap.map, {
      onPick: (picked) => latest.current.onPick(picked),
      onDraw: (...drawn) => latest.current.onDraw(...drawn),
      onMove: (...moved) => latest.current.onMove(...moved),
      onParts: (parts) => latest.current.onParts(parts),
      onFirst: (at) => latest.current.onFirst(at),
    });
    layer.current = made;
    return () => {
      layer.current = null;
      made.dispose();
      homeMap.picks = true;
    };
  }, [homeMap]);

  // At once: whoever sees a tool chosen may draw with it.
  useLayoutEffect(() => {
    if (homeMap) layer.current?.show({ document, tool, selection, scheme });
  }, [homeMap, document, tool, selection, scheme]);

  return useCallback(() => layer.current?.cancel() ?? false, []);
}
