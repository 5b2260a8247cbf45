import { Button } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type FormEvent, useId, useState } from "react";
import { Link } from "wouter";
import { answered, api, type Schemas } from "../api/client";
import { headQuery, parkedQuery, refreshAll } from "../api/queries";
import { floorKey } from "../map/floors";
import { mapPath } from "../paths";
import { texts } from "../texts";
import classes from "./ParkedPanel.module.css";

type Mission = Schemas["MissionDocument"];

interface ParkedPanelProps {
  readonly robot: string;
  readonly map: string;
  readonly floors: readonly Schemas["MapSummary"][];
}

/** Asks which floor a mission belongs to that was set aside; nothing where there is none. */
export function ParkedPanel({ robot, map, floors }: ParkedPanelProps) {
  const parked = useQuery(parkedQuery(robot, map));
  const [placed, setPlaced] = useState<Mission | null>(null);
  const waiting = parked.data ?? [];
  const first = waiting.find(({ id }) => id !== placed?.id) ?? waiting[0];
  return (
    <>
      {placed?.decision && <Placed robot={robot} here={map} decision={placed.decision} floors={floors} />}
      {first && (
        <ParkedQuestion
          key={first.id}
          mission={first}
          floors={floors}
          others={waiting.length - 1}
          titled
          onPlaced={(mission) => setPlaced(mission)}
        />
      )}
    </>
  );
}

interface QuestionProps {
  readonly mission: Mission;
  readonly floors: readonly Schemas["MapSummary"][];
  readonly others: number;
  /** Whether it says itself what is asked, where the page does not. */
  readonly titled: boolean;
  readonly onPlaced: (mission: Mission) => void;
}

export function ParkedQuestion({ mission, floors, others, titled, onPlaced }: QuestionProps) {
  const queries = useQueryClient();
  const [naming, setNaming] = useState(false);
  const place = useMutation({
    mutationFn: async ({ floor, title }: { floor: string; title?: string }) => {
      const path = { robot: mission.robot, map: mission.map, mission: mission.id };
      const done = await answered(
        api.POST("/api/v1/robots/{robot}/maps/{map}/missions/{mission}/placement", {
          params: { path },
          body: { map: floor },
        }),
      );
      if (title !== undefined && title !== floor) {
        const params = { path: { robot: mission.robot, map: floor } };
        await answered(api.PATCH("/api/v1/robots/{robot}/maps/{map}", { params, body: { name: title } }));
      }
      return done;
    },
    onSuccess: onPlaced,
    onSettled: () => refreshAll(queries),
  });
  const titleOf = (floor: string) => floors.find(({ map }) => map === floor)?.name ?? floor;
  const likely = mission.candidates.find(({ certain }) => certain);
  return (
    <section className={classes.question} aria-label={texts.parked.title}>
      {titled && <h2>{texts.parked.title}</h2>}
      <div className={classes.what}>
        {titled && <img src={mission.grid} alt={texts.parked.picture(mission.id)} />}
        <div>
          <p>{texts.parked.lead(mission.id)}</p>
          <p className={classes.reason} lang="en">
            {mission.reason}
          </p>
        </div>
      </div>
      {likely && (
        <BringBack robot={mission.robot} floor={likely.map} title={titleOf(likely.map)} share={likely.share} />
      )}
      <div className={classes.choices}>
        {mission.candidates.map(({ map, share, certain }) => (
          <Button
            key={map}
            variant={certain ? "filled" : "default"}
            className={classes.choice ?? ""}
            disabled={place.isPending}
            onClick={() => place.mutate({ floor: map })}
          >
            <span>
              <strong>{titleOf(map)}</strong>
              <span>
                {texts.parked.fit(Math.round(share * 100))}
                {certain && `, ${texts.parked.certain}`}
              </span>
            </span>
          </Button>
        ))}
        {!naming && (
          <Button variant="default" mih={44} disabled={place.isPending} onClick={() => setNaming(true)}>
            {texts.parked.newFloor}
          </Button>
        )}
      </div>
      {naming && (
        <NewFloor
          taken={floors.map(({ map }) => map)}
          busy={place.isPending}
          onMake={(floor, title) => place.mutate({ floor, title })}
          onCancel={() => setNaming(false)}
        />
      )}
      {place.isPending && <p role="status">{texts.parked.placing}</p>}
      {place.isError && <p role="alert">{place.error.message}</p>}
      {others > 0 && <p className={classes.reason}>{texts.parked.more(others)}</p>}
    </section>
  );
}

interface BringBackProps {
  readonly robot: string;
  readonly floor: string;
  readonly title: string;
  readonly share: number;
}

/** What is to be had again where a floor is known, as after a reset. */
function BringBack({ robot, floor, title, share }: BringBackProps) {
  const known = useQuery(headQuery(robot, floor));
  if (!known.data) return null;
  const count = (semantic: string) =>
    known.data.features.filter(({ properties }) => properties.semantic === semantic).length;
  return (
    <p className={classes.back}>
      {texts.parked.bringBack(title, Math.round(share * 100), count("room"), count("restriction"))}
    </p>
  );
}

interface NewFloorProps {
  readonly taken: readonly string[];
  readonly busy: boolean;
  readonly onMake: (floor: string, title: string) => void;
  readonly onCancel: () => void;
}

function NewFloor({ taken, busy, onMake, onCancel }: NewFloorProps) {
  const [title, setTitle] = useState("");
  const fieldId = useId();
  const make = (event: FormEvent) => {
    event.preventDefault();
    onMake(floorKey(title, taken), title.trim());
  };
  return (
    <form className={classes.naming} onSubmit={make}>
      <label htmlFor={fieldId}>{texts.parked.name}</label>
      <input
        id={fieldId}
        ref={(field) => field?.focus()}
        required
        maxLength={60}
        pattern=".*\S.*"
        value={title}
        onChange={(event) => setTitle(event.currentTarget.value)}
      />
      <div className={classes.choices}>
        <Button type="submit" mih={44} disabled={busy}>
          {texts.parked.add}
        </Button>
        <Button variant="default" mih={44} onClick={onCancel}>
          {texts.parked.cancel}
        </Button>
      </div>
    </form>
  );
}

interface PlacedProps {
  readonly robot: string;
  readonly here: string;
  readonly decision: NonNullable<Mission["decision"]>;
  readonly floors: readonly Schemas["MapSummary"][];
}

export function Placed({ robot, here, decision, floors }: PlacedProps) {
  const title = floors.find(({ map }) => map === decision.map)?.name ?? decision.map;
  const taken = decision.outcome !== "reverted" && decision.outcome !== "superseded";
  return (
    <div className={classes.placed} role="status">
      <p>{taken ? texts.parked.placed(title) : texts.parked.notTaken(title, decision.reason)}</p>
      {decision.version !== null && decision.map !== here && (
        <Link href={mapPath(robot, decision.map)}>{texts.parked.open(title)}</Link>
      )}
    </div>
  );
}
