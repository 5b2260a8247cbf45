import { type UseQueryResult, useQuery } from "@tanstack/react-query";
import { lazy, type ReactNode, Suspense } from "react";
import { Route, Switch, useLocation, useRoute } from "wouter";
import { isSignedOut } from "./api/client";
import { Live } from "./api/live";
import { robotsQuery, sessionQuery } from "./api/queries";
import { Header } from "./Header";
import { MapsPage } from "./pages/MapsPage";
import { SignedOutPage } from "./pages/SignedOutPage";
import { Failure, Loading, Nothing } from "./pages/states";
import {
  ACCOUNT_PATH,
  FLEET_PATH,
  FORGOTTEN_PATH,
  HOME_PATH,
  INVITATION_PATH,
  NEW_PASSWORD_PATH,
  OPERATOR_PATH,
  QUESTIONS_PATH,
  SETTINGS_PATH,
} from "./paths";
import { texts } from "./texts";

// The map page brings the map library along, which the list of maps has no need of.
const MapPage = lazy(() => import("./pages/MapPage"));
const QuestionsPage = lazy(() => import("./pages/QuestionsPage"));
const SettingsPage = lazy(() => import("./settings/SettingsPage"));
const ReviewPage = lazy(() => import("./review/ReviewPage"));
const FleetPages = lazy(() => import("./fleet/FleetPages"));
const PeoplePages = lazy(() => import("./people/PeoplePages"));
const ForgottenPage = lazy(async () => ({ default: (await import("./people/OpenPages")).ForgottenPage }));
const LinkPage = lazy(async () => ({ default: (await import("./people/OpenPages")).LinkPage }));
const OPEN: readonly string[] = [FORGOTTEN_PATH, INVITATION_PATH, NEW_PASSWORD_PATH];
const OF_PEOPLE: readonly string[] = [ACCOUNT_PATH, HOME_PATH, OPERATOR_PATH];

export function App() {
  const [ofFleet] = useRoute(`${FLEET_PATH}/*?`);
  const [path] = useLocation();
  if (OPEN.includes(path)) return <Open path={path} />;
  if (OF_PEOPLE.includes(path)) return <People />;
  return ofFleet ? <Fleet /> : <Homes />;
}

/** For whoever is not signed in. */
function Open({ path }: { readonly path: string }) {
  return (
    <Page>
      <Suspense fallback={<Loading />}>{path === FORGOTTEN_PATH ? <ForgottenPage /> : <LinkPage />}</Suspense>
    </Page>
  );
}

function People() {
  return <SignedIn asked={useQuery(sessionQuery)}>{() => <PeoplePages />}</SignedIn>;
}

/** Without the list of robots: a fleet has too many. */
function Fleet() {
  return <SignedIn asked={useQuery(sessionQuery)}>{() => <FleetPages />}</SignedIn>;
}

function Homes() {
  return (
    <SignedIn asked={useQuery(robotsQuery)}>
      {({ items: robots }) => (
        <Switch>
          <Route path="/">
            <MapsPage robots={robots} />
          </Route>
          <Route path={QUESTIONS_PATH}>
            <QuestionsPage robots={robots} />
          </Route>
          <Route path={SETTINGS_PATH}>
            <SettingsPage />
          </Route>
          <Route path="/robots/:robot/maps/:map/conflicts/:conflict">
            {({ robot, map, conflict }) => (
              <ReviewPage
                key={`${robot}/${map}/${conflict}`}
                robot={robot}
                map={map}
                conflict={conflict}
                robots={robots}
              />
            )}
          </Route>
          <Route path="/robots/:robot/maps/:map">
            {({ robot, map }) => <MapPage key={`${robot}/${map}`} robot={robot} map={map} robots={robots} />}
          </Route>
          <Route>
            <Nothing />
          </Route>
        </Switch>
      )}
    </SignedIn>
  );
}

interface SignedInProps<T> {
  readonly asked: UseQueryResult<T>;
  readonly children: (data: T) => ReactNode;
}

/** What needs somebody signed in, once what was asked for is there; else the way in. */
function SignedIn<T>({ asked: { data, error, isPending, refetch }, children }: SignedInProps<T>) {
  if (isSignedOut(error)) {
    return (
      <Page>
        <SignedOutPage look={() => void refetch()} />
      </Page>
    );
  }
  if (isPending) {
    return (
      <Page>
        <Loading />
      </Page>
    );
  }
  if (data === undefined) {
    return (
      <Page>
        <Failure what={texts.maps.failed} error={error} retry={() => void refetch()} />
      </Page>
    );
  }
  return (
    <Live>
      <Page live>
        <Suspense fallback={<Loading />}>{children(data)}</Suspense>
      </Page>
    </Live>
  );
}

function Page({ live = false, children }: { readonly live?: boolean; readonly children: ReactNode }) {
  return (
    <>
      <a className="skip-link" href="#content">
        {texts.skip}
      </a>
      <Header live={live} />
      <main id="content" tabIndex={-1}>
        {children}
      </main>
    </>
  );
}
