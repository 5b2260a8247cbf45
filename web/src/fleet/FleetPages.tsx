import { useQuery } from "@tanstack/react-query";
import { Link, Route, Switch, useLocation } from "wouter";
import { sessionQuery } from "../api/queries";
import { Loading, Nothing, Notice } from "../pages/states";
import { CausePage } from "./CausePage";
import { CausesPage } from "./CausesPage";
import classes from "./Fleet.module.css";
import { InspectorPage } from "./InspectorPage";
import { OperationsPage } from "./OperationsPage";
import { OverviewPage } from "./OverviewPage";
import { CAUSES_PATH, OPERATIONS_PATH, OVERVIEW_PATH, REPLAYS_PATH, ROLLOUTS_PATH, withSearch } from "./paths";
import { ReplayPage } from "./ReplayPage";
import { RolloutPage } from "./RolloutPage";
import { RolloutsPage } from "./RolloutsPage";
import { fleetTexts } from "./texts";
import { useFilters } from "./useFilters";

/** The pages for whoever runs the fleet. */
export default function FleetPages() {
  const { data } = useQuery(sessionQuery);
  const { search } = useFilters();
  const [path] = useLocation();
  if (!data) return <Loading />;
  if (!data.may.includes("figures")) {
    return (
      <Notice title={fleetTexts.onlyTitle}>
        <p>{fleetTexts.only}</p>
      </Notice>
    );
  }
  const tab = (address: string, name: string, on: boolean) => (
    <Link href={withSearch(address, search)} aria-current={on ? "page" : undefined}>
      {name}
    </Link>
  );
  return (
    <div className={classes.page}>
      <nav className={classes.tabs} aria-label={fleetTexts.pages}>
        {tab(OVERVIEW_PATH, fleetTexts.overview, path === OVERVIEW_PATH)}
        {tab(CAUSES_PATH, fleetTexts.causes, path.startsWith(CAUSES_PATH))}
        {tab(ROLLOUTS_PATH, fleetTexts.rollouts.title, path.startsWith(ROLLOUTS_PATH) || path.startsWith(REPLAYS_PATH))}
        {tab(OPERATIONS_PATH, fleetTexts.rollouts.operations, path === OPERATIONS_PATH)}
      </nav>
      <Switch>
        <Route path={OVERVIEW_PATH}>
          <OverviewPage />
        </Route>
        <Route path={CAUSES_PATH}>
          <CausesPage />
        </Route>
        <Route path={`${CAUSES_PATH}/:id`}>{({ id }) => <CausePage key={id} id={id} />}</Route>
        <Route path={ROLLOUTS_PATH}>
          <RolloutsPage />
        </Route>
        <Route path={`${ROLLOUTS_PATH}/:name`}>{({ name }) => <RolloutPage key={name} name={name} />}</Route>
        <Route path={`${REPLAYS_PATH}/:name`}>{({ name }) => <ReplayPage key={name} name={name} />}</Route>
        <Route path={OPERATIONS_PATH}>
          <OperationsPage />
        </Route>
        <Route path={`${OVERVIEW_PATH}/robots/:robot/maps/:map/missions/:mission`}>
          {({ robot, map, mission }) => <InspectorPage robot={robot} map={map} mission={mission} />}
        </Route>
        <Route>
          <Nothing />
        </Route>
      </Switch>
    </div>
  );
}
