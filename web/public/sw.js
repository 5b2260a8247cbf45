// Shows what the service pushes, and opens its page when it is tapped.

self.addEventListener("push", (event) => {
  const { title, body, tag, url, actions = [] } = event.data.json();
  const shown = {
    body,
    tag,
    icon: "/icon.svg",
    // Each leads to the page on which the answer is confirmed.
    actions: actions.map((one) => ({ action: one.url, title: one.title })),
    data: { url },
  };
  event.waitUntil(self.registration.showNotification(title, shown));
});

self.addEventListener("notificationclick", (event) => {
  event.notification.close();
  event.waitUntil(open(event.action || event.notification.data.url));
});

async function open(path) {
  const url = new URL(path, self.location.origin);
  if (url.origin !== self.location.origin) return;
  const pages = await self.clients.matchAll({ type: "window" });
  const page = pages.find((one) => new URL(one.url).pathname === url.pathname);
  if (page && url.search === "") await page.focus();
  else await self.clients.openWindow(url.href);
}
