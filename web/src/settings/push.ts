/** This browser's own subscription to messages. */

import { answered, api, type Schemas } from "../api/client";
import { language } from "../texts";

const KEPT = "stillroom-push";
const WORKER = "/sw.js";

export const canPush = (): boolean =>
  "serviceWorker" in navigator && "PushManager" in window && "Notification" in window;

/** The number by which the service knows this browser; null where it shows no messages. */
export async function ownSubscription(): Promise<string | null> {
  if (!canPush()) return null;
  const registration = await navigator.serviceWorker.getRegistration(WORKER);
  const subscription = await registration?.pushManager.getSubscription();
  return subscription ? localStorage.getItem(KEPT) : null;
}

/** Asks the person, the browser and the service, in that order. Throws where one of them won't. */
export async function subscribe(publicKey: string): Promise<Schemas["PushSubscriptionDocument"]> {
  if ((await Notification.requestPermission()) !== "granted") throw new PushDenied();
  const registration = await navigator.serviceWorker.register(WORKER);
  await navigator.serviceWorker.ready;
  const made = await registration.pushManager.subscribe({ userVisibleOnly: true, applicationServerKey: publicKey });
  return tell(made);
}

/** At the start of the app: the browser may have renewed what the service knows of it. */
export async function renew(): Promise<void> {
  if (!canPush() || Notification.permission !== "granted") return;
  const registration = await navigator.serviceWorker.getRegistration(WORKER);
  const subscription = await registration?.pushManager.getSubscription();
  if (subscription) await tell(subscription);
}

export async function unsubscribe(): Promise<void> {
  const registration = await navigator.serviceWorker.getRegistration(WORKER);
  const subscription = await registration?.pushManager.getSubscription();
  await subscription?.unsubscribe();
  localStorage.removeItem(KEPT);
}

export class PushDenied extends Error {
  override readonly name = "PushDenied";
}

async function tell(subscription: PushSubscription): Promise<Schemas["PushSubscriptionDocument"]> {
  const { endpoint, expirationTime, keys } = subscription.toJSON();
  const known = await answered(
    api.POST("/api/v1/notifications/push/subscriptions", {
      body: {
        endpoint: endpoint ?? "",
        expirationTime: expirationTime ?? null,
        keys: { p256dh: keys?.["p256dh"] ?? "", auth: keys?.["auth"] ?? "" },
        label: browserName(navigator.userAgent),
        language,
      },
    }),
  );
  localStorage.setItem(KEPT, known.id);
  return known;
}

/** "Firefox, Linux": as a person would tell their browsers apart. */
export function browserName(userAgent: string): string {
  const find = (names: readonly (readonly [RegExp, string])[]) => names.find(([known]) => known.test(userAgent))?.[1];
  const browser = find([
    [/Edg\//, "Edge"],
    [/OPR\//, "Opera"],
    [/Firefox\//, "Firefox"],
    [/Chrome\//, "Chrome"],
    [/Safari\//, "Safari"],
  ]);
  const system = find([
    [/Android/, "Android"],
    [/iPhone|iPad/, "iOS"],
    [/Windows/, "Windows"],
    [/Mac OS X/, "macOS"],
    [/Linux/, "Linux"],
  ]);
  return [browser, system].filter(Boolean).join(", ");
}
