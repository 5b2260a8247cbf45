/** Was die Seite des eigenen Zuhauses darüber sagt, was von ihm aufgehoben wird. */

import type { PrivacyTexts } from "../texts";

const count = (n: number, one: string, many: string) => `${n} ${n === 1 ? one : many}`;

export const privacyDe: PrivacyTexts = {
  title: "Was aufgehoben wird",
  lead: "Karten gehören zu Ihrem Zuhause. Sichern Sie sie, sehen Sie, wer sie angesehen hat, und löschen Sie sie, wann Sie wollen.",
  save: "Alles sichern",
  saveHome: "Das ganze Zuhause sichern",
  bringInHome: "Gesichertes Zuhause einspielen",
  whole:
    "Eine Datei mit allen Karten aller Roboter und ihrem Verlauf, wer zum Zuhause gehört und wer geschaut hat. Beim Einspielen kommen Karten Ihrer Roboter wieder zu diesen; andere werden ohne Roboter aufgehoben.",
  saveOf: (robot) => `Alles sichern: ${robot}`,
  bringIn: "Karten einspielen",
  bringInOf: (robot) => `Gesicherte Karten bei ${robot} einspielen`,
  broughtIn: (maps, versions) =>
    `Eingespielt: ${count(maps, "Karte", "Karten")}, ${count(versions, "Fassung", "Fassungen")}.`,
  clash: "Der Roboter hat schon eine Karte mit diesem Namen.",
  unreadable: "Diese Datei lässt sich nicht verwenden: Sie ist kein gesichertes Zuhause oder wurde verändert.",
  log: "Wer geschaut hat",
  logOf: (robot) => `Wer geschaut hat: ${robot}`,
  nobody: "Niemand hat etwas angesehen oder geändert.",
  did: { look: "sah an:", change: "änderte:", plan: "sah mit Ihrer Erlaubnis den Grundriss an:" },
  things: {
    robot: "den Roboter",
    map: "die Karte",
    versions: "den Verlauf",
    missions: "Fahrten",
    conflicts: "Fragen",
    edits: "die Räume",
    rooms: "die Räume",
    segments: "die Räume",
    pin: "die angeheftete Fassung",
    archive: "alles, um es zu sichern",
    home: "alles vom Zuhause, um es zu sichern",
    token: "das Token",
    release: "wem er gehört",
  },
  times: (n) => (n === 1 ? "" : `, ${n}-mal`),
  from: (network) => `von ${network}`,
  erase: "Karten löschen",
  eraseOf: (robot) => `Karten löschen: ${robot}`,
  eraseTitle: (robot) => `Alle Karten von ${robot} löschen?`,
  eraseText:
    "Alle Karten, alle Fassungen, alles, was der Roboter wahrgenommen hat, und alle Fragen und Antworten werden sofort und endgültig gelöscht. Der Roboter bleibt Ihrer und fängt neu an. Sichern Sie vorher alles, falls Sie es noch brauchen könnten.",
  eraseHome: "Alles und das Konto löschen",
  eraseHomeTitle: "Alles von Ihrem Zuhause und Ihr Konto löschen?",
  eraseHomeText:
    "Alle Karten aller Ihrer Roboter, wer sie sehen darf, Ihre Nachrichten und Ihr Konto werden sofort und endgültig gelöscht. Die Roboter gehören danach niemandem: Ein Betreiber kann sie jemand anderem geben. Die Zahlen der Flotte behalten Nummern, die zu niemandem führen.",
  confirm: (name) => `Zur Bestätigung ${name} eintippen`,
  yes: "Endgültig löschen",
  cancel: "Abbrechen",
  erased: (maps, missions) => `Gelöscht: ${count(maps, "Karte", "Karten")}, ${count(missions, "Fahrt", "Fahrten")}.`,
  keep: "Wie lange aufgehoben wird, was die Roboter wahrgenommen haben",
  days: (days) => (days === 0 ? "Solange es das Zuhause gibt" : `${days} Tage`),
  effect: (days, newest) =>
    days === 0
      ? "Was die Roboter wahrgenommen haben, wird aufgehoben, bis Sie es löschen."
      : `Was die Roboter wahrgenommen haben, wird ${days} Tage nach dem Eintreffen gelöscht. Die neuesten ${newest} Fassungen jeder Karte, angeheftete und benannte Fassungen und offene Fragen behalten es. Die Formen der Räume bleiben im Verlauf.`,
  now: (missions) =>
    missions === 0
      ? "Jetzt ist nichts so alt."
      : `Jetzt älter: ${count(missions, "Fahrt", "Fahrten")}; was dabei wahrgenommen wurde, wird binnen Minuten gelöscht.`,
  choose: "So lange aufheben",
};
