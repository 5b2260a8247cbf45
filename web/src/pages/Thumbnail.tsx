import { roomFill, type Scheme } from "../map/colours";
import type { Position, Ring } from "../map/document";
import type { MapView } from "../map/view";
import classes from "./Thumbnail.module.css";

interface ThumbnailProps {
  readonly view: MapView;
  readonly scheme: Scheme;
  readonly label: string;
}

/** The map drawn small. In metres, y turned over, as the screen's y points down. */
export function Thumbnail({ view, scheme, label }: ThumbnailProps) {
  const [west, south, east, north] = view.bounds;
  return (
    <svg
      className={classes.thumbnail}
      role="img"
      aria-label={label}
      viewBox={`${west} ${-north} ${east - west} ${north - south}`}
    >
      {view.rooms.map((room) => (
        <path key={room.id} className={classes.room} d={outlinePath(room.rings)} fill={roomFill(room.slot, scheme)} />
      ))}
      {view.walls.map((wall) => (
        <path key={wall.id} className={classes.wall} d={linePath(wall.geometry.coordinates)} />
      ))}
    </svg>
  );
}

function outlinePath(rings: readonly Ring[]): string {
  return rings.map((ring) => `${linePath(ring)}Z`).join("");
}

function linePath(points: readonly Position[]): string {
  return points.map(([x, y], i) => `${i === 0 ? "M" : "L"}${x.toFixed(3)} ${(-y).toFixed(3)}`).join("");
}
