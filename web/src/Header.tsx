import { ActionIcon, useMantineColorScheme } from "@mantine/core";
import { Link } from "wouter";
import { useConnection } from "./api/live";
import classes from "./Header.module.css";
import { Icon } from "./icons";
import { texts } from "./texts";

const NEXT = { auto: "light", light: "dark", dark: "auto" } as const;
const ICONS = { auto: "system", light: "sun", dark: "moon" } as const;

export function Header({ live }: { readonly live: boolean }) {
  return (
    <header className={classes.header}>
      <Link href="/" className={classes.brand}>
        <img src="/icon.svg" alt="" width={28} height={28} />
        {texts.product}
      </Link>
      <div className={classes.tools}>
        {live && <ConnectionState />}
        <SchemeSwitch />
      </div>
    </header>
  );
}

function ConnectionState() {
  const connection = useConnection();
  const { label, hint } = texts.connection[connection];
  return (
    <span className={classes.connection} role="status" data-state={connection} title={hint}>
      {label}
    </span>
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
