import { Skeleton, useComputedColorScheme } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useMemo, useRef } from "react";
import { Link } from "wouter";
import type { Schemas } from "../api/client";
import { headQuery, lastMissionQuery, questionsQuery } from "../api/queries";
import { Moment } from "../Moment";
import { ofMap } from "../map/questions";
import { viewMap } from "../map/view";
import { mapPath } from "../paths";
import { area, texts } from "../texts";
import { useSeen } from "../useSeen";
import { describeMission } from "../words";
import classes from "./MapCard.module.css";
import { Thumbnail } from "./Thumbnail";

interface MapCardProps {
  readonly robot: string;
  readonly map: Schemas["MapSummary"];
}

export function MapCard({ robot, map }: MapCardProps) {
  const card = useRef<HTMLLIElement>(null);
  const seen = useSeen(card);
  const head = useQuery({ ...headQuery(robot, map.map), enabled: seen && map.version !== null });
  const mission = useQuery({ ...lastMissionQuery(robot, map.map), enabled: seen });
  const open = ofMap(useQuery(questionsQuery("open")).data?.items ?? [], robot, map.map).length;
  const scheme = useComputedColorScheme("light");
  const view = useMemo(() => head.data && viewMap(head.data), [head.data]);
  const last = mission.data;

  return (
    <li ref={card} className={classes.card}>
      <div className={classes.picture}>
        {view ? (
          <Thumbnail view={view} scheme={scheme} label={texts.maps.thumbnail(map.name)} />
        ) : map.version === null ? (
          <p className={classes.waiting}>{texts.maps.waiting}</p>
        ) : (
          <Skeleton height="100%" radius={0} />
        )}
      </div>
      <div className={classes.facts}>
        <h3>
          <Link href={mapPath(robot, map.map)}>{map.name}</Link>
        </h3>
        <p>
          {texts.maps.rooms(map.rooms)}
          {view && view.area > 0 && `, ${area(view.area)}`}
          {map.name !== map.map && ` · ${texts.maps.floor(map.map)}`}
        </p>
        {open > 0 && <p className={classes.open}>{texts.questions.badge(open)}</p>}
        <p className={classes.mission} data-outcome={last?.outcome}>
          {last ? (
            <>
              {describeMission(last)} <Moment at={last.received_at} />
            </>
          ) : (
            mission.isSuccess && texts.maps.noMissions
          )}
        </p>
      </div>
    </li>
  );
}
