import { useDebouncedValue } from "@mantine/hooks";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import type { MapDocument } from "../map/document";
import { isDirty } from "../map/draft";
import type { Place } from "./calls";
import { type Difference, differenceOf, tryOut } from "./sensitivity";
import type { Editing, EditSession } from "./session";

const DEBOUNCE_MS = 250;

export interface Sensitivity {
  /** Where the slider stands. */
  readonly value: number;
  readonly isTrying: boolean;
  /** What the rooms would be; null: nothing is tried, or it is not known yet. */
  readonly document: MapDocument | null;
  readonly difference: Difference | null;
  /** Whether taking it would change anything. */
  readonly changes: boolean;
  /** Whether what is shown is what the slider says. */
  readonly isCurrent: boolean;
  readonly failed: boolean;
  /** Other changes are not saved yet: they come first. */
  readonly blocked: boolean;
  readonly move: (value: number) => void;
  readonly leave: () => void;
  /** Applies what is shown as a new version. */
  readonly take: () => Promise<void>;
}

/** Rooms parted more or less finely: tried out beside the draft, which nothing of it touches until it is taken. */
export function useSensitivity({ robot, map }: Place, { draft, document }: Editing, session: EditSession): Sensitivity {
  const [tried, setTried] = useState<number | null>(null);
  const [taken, setTaken] = useState({ version: 0, value: 0 });
  const [taking, setTaking] = useState<number | null>(null);
  const [asked] = useDebouncedValue(tried, DEBOUNCE_MS);
  const dirty = isDirty(draft);
  const version = draft.present.base;

  const query = useQuery({
    queryKey: ["sensitivity", robot, map, version, asked],
    queryFn: ({ signal }) => tryOut({ robot, map }, asked ?? 0, signal),
    enabled: tried !== null && asked !== null && !dirty,
    placeholderData: keepPreviousData,
    retry: 1,
  });

  // Whoever goes on to change something else has left what was tried.
  useEffect(() => {
    if (dirty) setTried(null);
  }, [dirty]);

  const isTrying = tried !== null && !dirty;
  const trial = isTrying && query.data?.version === version ? query.data : null;
  const isCurrent = trial !== null && tried === asked && !query.isPlaceholderData;

  const take = async () => {
    if (!trial || tried === null) return;
    setTaking(tried);
    const applied = await session.attempt(() => trial.operations);
    if (applied) await session.save();
    const { draft: after, lastSaved } = session.get();
    if (applied && lastSaved !== null && !isDirty(after)) setTaken({ version: lastSaved, value: tried });
    setTried(null);
    setTaking(null);
  };

  return {
    // At rest it stands where the map in force was taken from.
    value: tried ?? taking ?? (taken.version === version ? taken.value : 0),
    isTrying,
    document: trial && (trial.document ?? document),
    difference: trial && differenceOf(document, trial.document ?? document),
    changes: trial !== null && trial.document !== null,
    isCurrent,
    failed: isTrying && tried === asked && (query.isError || query.fetchStatus === "paused"),
    blocked: dirty && taking === null,
    move: setTried,
    leave: () => setTried(null),
    take,
  };
}
