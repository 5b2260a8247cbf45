import { useQuery } from "@tanstack/react-query";
import { Link } from "wouter";
import { Failure, Loading } from "../pages/states";
import { QUESTIONS_PATH } from "../paths";
import classes from "../people/People.module.css";
import { texts } from "../texts";
import { EmailSection } from "./EmailSection";
import { LanguageChoice } from "./LanguageChoice";
import { PushSection } from "./PushSection";
import { settingsQuery, webhooksQuery } from "./queries";
import { settingsTexts } from "./texts";
import { WebhooksSection } from "./WebhooksSection";

/** By which ways a person is told, and about what. */
export default function SettingsPage() {
  const settings = useQuery(settingsQuery);
  const webhooks = useQuery(webhooksQuery);
  const failed = [settings, webhooks].find(({ isError, data }) => isError && !data);
  if (failed) return <Failure what={settingsTexts.failed} error={failed.error} retry={() => void failed.refetch()} />;
  if (!settings.data || !webhooks.data) return <Loading />;
  return (
    <div className={classes.page}>
      <title>{`${settingsTexts.title} · ${texts.product}`}</title>
      <Link href={QUESTIONS_PATH}>{settingsTexts.back}</Link>
      <h1>{settingsTexts.title}</h1>
      <p>{settingsTexts.lead}</p>
      <LanguageChoice chosen={settings.data.language} />
      <EmailSection email={settings.data.email} />
      <PushSection push={settings.data.push} />
      <WebhooksSection webhooks={webhooks.data.items} />
    </div>
  );
}
