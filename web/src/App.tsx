import { useQuery } from "@tanstack/react-query";
import { lazy, Suspense } from "react";
import { Route, Switch } from "wouter";
import { isSignedOut } from "./api/client";
import { Live } from "./api/live";
import { robotsQuery } from "./api/queries";
import { Header } from "./Header";
import { MapsPage } from "./pages/MapsPage";
import { SignedOutPage } from "./pages/SignedOutPage";
import { Failure, Loading, Nothing } from "./pages/states";
import { QUESTIONS_PATH, SETTINGS_PATH } from "./paths";
import { texts } from "./texts";

// The map page brings the map library along, which the list of maps has no need of.
const MapPage = lazy(() => import("./pages/MapPage"));
const QuestionsPage = lazy(() => import("./pages/QuestionsPage"));
const SettingsPage = lazy(() => import("./settings/SettingsPage"));
const ReviewPage = lazy(() => import("./review/ReviewPage"));

export function App() {
  const robots = useQuery(robotsQuery);
  if (isSignedOut(robots.error)) {
    return (
      <Page>
        <SignedOutPage look={() => void robots.refetch()} />
      </Page>
    );
  }
  if (robots.isPending) {
    return (
      <Page>
        <Loading />
      </Page>
    );
  }
  if (robots.data === undefined) {
    return (
      <Page>
        <Failure what={texts.maps.failed} error={robots.error} retry={() => void robots.refetch()} />
      </Page>
    );
  }
  return (
    <Live>
      <Page live>
        <Suspense fallback={<Loading />}>
          <Switch>
            <Route path="/">
              <MapsPage robots={robots.data.items} />
            </Route>
            <Route path={QUESTIONS_PATH}>
              <QuestionsPage robots={robots.data.items} />
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
                  robots={robots.data.items}
                />
              )}
            </Route>
            <Route path="/robots/:robot/maps/:map">
              {({ robot, map }) => (
                <MapPage key={`${robot}/${map}`} robot={robot} map={map} robots={robots.data.items} />
              )}
            </Route>
            <Route>
              <Nothing />
            </Route>
          </Switch>
        </Suspense>
      </Page>
    </Live>
  );
}

function Page({ live = false, children }: { readonly live?: boolean; readonly children: React.ReactNode }) {
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
