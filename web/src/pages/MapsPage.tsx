import type { Schemas } from "../api/client";
import { texts } from "../texts";
import { MapCard } from "./MapCard";
import classes from "./MapsPage.module.css";
import { Command, Notice } from "./states";

export function MapsPage({ robots }: { readonly robots: readonly Schemas["RobotSummary"][] }) {
  if (robots.length === 0) {
    return (
      <Notice title={texts.maps.empty.title}>
        <p>{texts.maps.empty.text}</p>
        <Command>{"stillroom robots add RB-0042\nstillroom upload map.png --robot RB-0042 --map ground"}</Command>
        <p>{texts.maps.empty.after}</p>
      </Notice>
    );
  }
  return (
    <div className={classes.page}>
      <title>{`${texts.maps.title} · ${texts.product}`}</title>
      <h1>{texts.maps.title}</h1>
      {robots.map((robot) => (
        <section key={robot.id} aria-labelledby={`robot-${robot.id}`} className={classes.robot}>
          <h2 id={`robot-${robot.id}`}>
            {robot.name}
            {robot.name !== robot.id && <span className={classes.id}>{robot.id}</span>}
          </h2>
          {robot.maps.length === 0 ? (
            <p className={classes.none}>{texts.maps.noMaps}</p>
          ) : (
            <ul className={classes.maps}>
              {robot.maps.map((map) => (
                <MapCard key={map.map} robot={robot.id} map={map} />
              ))}
            </ul>
          )}
        </section>
      ))}
    </div>
  );
}
