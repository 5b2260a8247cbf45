import { useComputedColorScheme } from "@mantine/core";
import { useEffect, useRef } from "react";
import { Icon } from "../icons";
import { roomFill } from "../map/colours";
import type { RoomView } from "../map/view";
import { area, texts } from "../texts";
import classes from "./RoomsPanel.module.css";

interface RoomsPanelProps {
  readonly rooms: readonly RoomView[];
  readonly selected: string | null;
  readonly onSelect: (room: string | null) => void;
}

/** The rooms as a list: the same things that the map shows, for those who do not see or point at it. */
export function RoomsPanel({ rooms, selected, onSelect }: RoomsPanelProps) {
  if (rooms.length === 0) return <p className={classes.none}>{texts.map.noRooms}</p>;
  return (
    <ul className={classes.rooms}>
      {rooms.map((room) => (
        <RoomItem key={room.id} room={room} isSelected={room.id === selected} onSelect={onSelect} />
      ))}
    </ul>
  );
}

interface RoomItemProps {
  readonly room: RoomView;
  readonly isSelected: boolean;
  readonly onSelect: (room: string | null) => void;
}

function RoomItem({ room, isSelected, onSelect }: RoomItemProps) {
  const scheme = useComputedColorScheme("light");
  const item = useRef<HTMLLIElement>(null);
  useEffect(() => {
    // On a phone the list lies below the map, and must not pull the page away from under the finger.
    if (isSelected && isBesideTheMap(item.current)) item.current?.scrollIntoView({ block: "nearest" });
  }, [isSelected]);
  return (
    <li ref={item} className={classes.room} data-selected={isSelected}>
      <button
        type="button"
        className={classes.choose}
        aria-pressed={isSelected}
        onClick={() => onSelect(isSelected ? null : room.id)}
      >
        <span className={classes.swatch} style={{ background: roomFill(room.slot, scheme) }} />
        <span className={classes.name}>{room.name}</span>
        {room.pinned && <Icon name="pin" size={16} />}
        <span className={classes.area}>{area(room.area)}</span>
      </button>
      {isSelected && <RoomDetails room={room} onSelect={onSelect} />}
    </li>
  );
}

function RoomDetails({ room, onSelect }: { readonly room: RoomView; readonly onSelect: (room: string) => void }) {
  return (
    <div className={classes.details}>
      {room.neighbours.length === 0 ? (
        <p>{texts.room.alone}</p>
      ) : (
        <>
          <p id={`next-to-${room.id}`}>{texts.room.opensTo}</p>
          <ul aria-labelledby={`next-to-${room.id}`}>
            {room.neighbours.map((other) => (
              <li key={other.id}>
                <button type="button" onClick={() => onSelect(other.id)}>
                  {other.name} <span>{other.passages.map((passage) => texts.room.passage[passage]).join(", ")}</span>
                </button>
              </li>
            ))}
          </ul>
        </>
      )}
      {room.pinned && <p>{texts.room.pinned}</p>}
      {room.lastVisited !== null && <p>{texts.room.lastVisited(room.lastVisited)}</p>}
    </div>
  );
}

function isBesideTheMap(item: Element | null): boolean {
  const panel = item?.closest("aside");
  return panel !== null && panel !== undefined && getComputedStyle(panel).overflowY === "auto";
}
