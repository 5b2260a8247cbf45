import { useQuery } from "@tanstack/react-query";
import { Link, Route, Switch, useLocation } from "wouter";
import { sessionQuery } from "../api/queries";
import { Loading, Nothing } from "../pages/states";
import { ACCOUNT_PATH, HOME_PATH, OPERATOR_PATH, SETTINGS_PATH } from "../paths";
import { AccountPage } from "./AccountPage";
import { HomePage } from "./HomePage";
import { OperatorPage } from "./OperatorPage";
import classes from "./People.module.css";
import { peopleTexts } from "./texts";

/** One's account, one's home, and for operators robots and accounts. */
export default function PeoplePages() {
  const { nav } = peopleTexts;
  const { data } = useQuery(sessionQuery);
  const [path] = useLocation();
  if (!data) return <Loading />;
  const pages: readonly (readonly [string, string, boolean])[] = [
    [ACCOUNT_PATH, nav.account, true],
    [HOME_PATH, nav.home, data.may.includes("household")],
    [OPERATOR_PATH, nav.operator, data.may.includes("accounts")],
    [SETTINGS_PATH, nav.messages, true],
  ];
  return (
    <div className={classes.page}>
      <nav className={classes.tabs} aria-label={nav.label}>
        {pages.map(
          ([address, name, shown]) =>
            shown && (
              <Link key={address} href={address} aria-current={path === address ? "page" : undefined}>
                {name}
              </Link>
            ),
        )}
      </nav>
      <Switch>
        <Route path={ACCOUNT_PATH}>
          <AccountPage />
        </Route>
        {data.may.includes("household") && data.id && (
          <Route path={HOME_PATH}>
            <HomePage email={data.id} />
          </Route>
        )}
        {data.may.includes("accounts") && (
          <Route path={OPERATOR_PATH}>
            <OperatorPage email={data.id} />
          </Route>
        )}
        <Route>
          <Nothing />
        </Route>
      </Switch>
    </div>
  );
}
