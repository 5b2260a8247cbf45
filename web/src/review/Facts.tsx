import { useMemo } from "react";
import type { MapDocument } from "../map/document";
import { type Conflict, isDiscovery } from "../map/questions";
import { viewMap } from "../map/view";
import { describeScore } from "../words";
import { changedPlaces } from "./changes";
import classes from "./Review.module.css";
import type { Sensed } from "./stage";
import { reviewTexts } from "./texts";

interface FactsProps {
  readonly conflict: Conflict;
  readonly sensed: Sensed;
  readonly here: MapDocument;
  readonly selected: string | null;
  readonly onSelect: (room: string) => void;
}

const MOST = 6;

/** What the picture shows, in words. */
export function Facts({ conflict, sensed, here, selected, onSelect }: FactsProps) {
  const places = useMemo(() => {
    const rooms = conflict.rooms.map(({ id }) => id);
    return changedPlaces(sensed.differences, viewMap(here), rooms);
  }, [conflict.rooms, sensed.differences, here]);
  return (
    <div className={classes.facts}>
      {conflict.rooms.length > 0 && (
        <section aria-labelledby="rooms-concerned">
          <h2 id="rooms-concerned">{reviewTexts.rooms}</h2>
          <ul>
            {conflict.rooms.map((room) => (
              <li key={room.id}>
                <button type="button" aria-pressed={room.id === selected} onClick={() => onSelect(room.id)}>
                  <strong>{room.name}</strong> {describeRoom(conflict, room)}
                </button>
              </li>
            ))}
          </ul>
        </section>
      )}
      <section aria-labelledby="what-changed">
        <h2 id="what-changed">{reviewTexts.changes}</h2>
        {sensed.confirmed.length > 0 && (
          <ul>
            {sensed.confirmed.map(({ room }) => (
              <li key={room} data-change="confirmed">
                {reviewTexts.confirmed(conflict.rooms.find(({ id }) => id === room)?.name ?? "")}
              </li>
            ))}
          </ul>
        )}
        {places.length === 0 ? (
          <p>{sensed.moved === null ? reviewTexts.apart : reviewTexts.noChanges}</p>
        ) : (
          <ul>
            {places.slice(0, MOST).map(({ change, room, area }) => (
              <li key={`${change} ${room?.id}`} data-change={change}>
                {reviewTexts.change[change](room?.name ?? reviewTexts.outside, area)}
              </li>
            ))}
            {places.length > MOST && <li>{reviewTexts.more(places.length - MOST)}</li>}
          </ul>
        )}
      </section>
    </div>
  );
}

function describeRoom(conflict: Conflict, room: Conflict["rooms"][number]): string {
  if (isDiscovery(conflict)) return reviewTexts.isNew;
  return conflict.kind === "drift" ? reviewTexts.slid(Math.round((1 - room.precision) * 100)) : describeScore(room);
}
