import { ActionIcon, useMantineColorScheme } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { Link } from "wouter";
import { useConnection } from "./api/live";
import { questionsQuery, sessionQuery } from "./api/queries";
import classes from "./Header.module.css";
import { Icon } from "./icons";
import { ACCOUNT_PATH, FLEET_PATH, QUESTIONS_PATH } from "./paths";
import { switchLanguage, texts } from "./texts";

const NEXT = { auto: "light", light: "dark", dark: "auto" } as const;
const ICONS = { auto: "system", light: "sun", dark: "moon" } as const;

export function Header({ live }: { readonly live: boolean }) {
  // `live`: somebody is signed in.
  return (
    <header className={classes.header}>
      <Link href="/" className={classes.brand}>
        <img src="/icon.svg" alt="" width={28} height={28} />
        <span className={classes.name}>{texts.product}</span>
      </Link>
      <div className={classes.tools}>
        {live && <ConnectionState />}
        {live && <FleetLink />}
        {live && <QuestionBadge />}
        <button
          type="button"
          className={classes.language}
          aria-label={texts.language.label}
          title={texts.language.label}
          onClick={switchLanguage}
        >
          {texts.language.short}
        </button>
        <SchemeSwitch />
        {live && <AccountLink />}
      </div>
    </header>
  );
}

function ConnectionState() {
  const connection = useConnection();
  const { label, hint } = texts.connection[connection];
  return (
    <span className={classes.connection} role="status" data-state={connection} title={hint}>
      <span className={classes.state}>{label}</span>
    </span>
  );
}

/** For whoever runs the fleet; owners have no use for it. */
function FleetLink() {
  const { data } = useQuery(sessionQuery);
  if (!data?.may.includes("figures")) return null;
  return (
    <Link href={FLEET_PATH} className={classes.questions} aria-label={texts.fleet} title={texts.fleet}>
      <Icon name="chart" />
    </Link>
  );
}

/** How much waits for an answer, wherever one is. */
function QuestionBadge() {
  const open = useQuery(questionsQuery("open"));
  if (!open.data) return null;
  const n = open.data.items.length;
  const said = texts.questions.badge(n);
  return (
    <Link href={QUESTIONS_PATH} className={classes.questions} aria-label={said} title={said} data-open={n > 0}>
      <Icon name="ask" />
      {n > 0 && <span className={classes.count}>{open.data.next === null ? n : `${n}+`}</span>}
    </Link>
  );
}

function SchemeSwitch() {
  const { colorScheme, setColorScheme } = useMantineColorScheme();
  return (
    <ActionIcon
      variant="subtle"
      color="gray"
      size={44}
      className={classes.scheme}
      aria-label={texts.scheme[colorScheme]}
      title={texts.scheme[colorScheme]}
      onClick={() => setColorScheme(NEXT[colorScheme])}
    >
      <Icon name={ICONS[colorScheme]} />
    </ActionIcon>
  );
}

/** Where one's password, browsers and home are, and the way out. */
function AccountLink() {
  return (
    <Link href={ACCOUNT_PATH} className={classes.questions} aria-label={texts.account} title={texts.account}>
      <Icon name="person" />
    </Link>
  );
}
