"""How people are told: e-mail, browsers, webhooks."""

import json
import re
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Page, expect

from tests.e2e import calling
from tests.e2e.asking import OWNER
from tests.e2e.conftest import OpenPage, Running

PUSH_SERVICE = """
    // The browser's maker runs a push service that is not to be had here: everything but that is real.
    const subscription = {
        toJSON: () => ({
            endpoint: "https://push.example.org/send/1",
            expirationTime: null,
            keys: {
                p256dh: "BCVxsr7N_eNgVRqvHtD0zTZsEc6-VV-JvLexhqUzORcxaOzi6-AYWXvTBHm4bjyPjs7Vd8pZGH6SRpkNtoIAiw4",
                auth: "BTBZMqHH6r4Tts7J_aSIgg",
            },
        }),
        unsubscribe: async () => { localStorage.removeItem("subscribed"); return true; },
    };
    PushManager.prototype.subscribe = async () => { localStorage.setItem("subscribed", "1"); return subscription; };
    PushManager.prototype.getSubscription = async () => localStorage.getItem("subscribed") ? subscription : null;
"""


def section(page: Page, name: str) -> "Callable[[str], None]":
    region = page.get_by_role("region", name=name)

    def says(words: str) -> None:
        expect(region).to_contain_text(re.compile(words))

    return says


def test_a_webhook_is_added_with_a_secret_shown_once_and_removed(
    served: Running, open_page: OpenPage, keep: Callable[[Page, str], None]
) -> None:
    page = open_page("/questions")
    page.get_by_role("link", name="How you are told").click()
    section(page, "E-mail")("has no mail server")
    webhooks = page.get_by_role("region", name="Webhooks")
    webhooks.get_by_label("Address (https)").fill("http://127.0.0.1:9/hook")
    webhooks.get_by_role("button", name="Add a webhook").click()
    expect(webhooks.get_by_role("alert")).to_be_visible()
    webhooks.get_by_label("Address (https)").fill("https://hooks.example.org/stillroom")
    webhooks.get_by_label("What it is for").fill("Lights")
    for unwanted in ("a map has a new version", "a room was found"):
        webhooks.get_by_role("checkbox", name=unwanted).uncheck()
    webhooks.get_by_role("button", name="Add a webhook").click()
    section(page, "Webhooks")(r"shown this once: whsec_\S+")
    keep(page, "settings-1440-light")
    (made,) = calling.get(f"{served.url}/api/v1/webhooks", headers=OWNER).json()["items"]
    assert (made["label"], len(made["types"])) == ("Lights", 4)
    page.reload()
    expect(webhooks.get_by_text("whsec_")).to_have_count(0)
    webhooks.get_by_role("button", name="Turn off").click()
    expect(webhooks.get_by_role("button", name="Turn on")).to_be_visible()
    webhooks.get_by_role("button", name="Last deliveries").click()
    expect(webhooks.get_by_text("Nothing was sent yet.")).to_be_visible()
    webhooks.get_by_role("button", name="Remove").click()
    expect(webhooks.get_by_text("Lights")).to_have_count(0)


def test_a_browser_shows_what_is_pushed_to_it_until_it_is_told_not_to(served: Running, open_page: OpenPage) -> None:
    page = open_page("/settings", permissions=["notifications"])
    page.add_init_script(PUSH_SERVICE)
    page.reload()
    page.get_by_role("combobox", name="Messages are in").select_option("Deutsch")
    expect(page.get_by_role("status").filter(has_text="Saved.")).to_be_attached()
    assert calling.get(f"{served.url}/api/v1/notifications", headers=OWNER).json()["language"] == "de"
    page.get_by_role("button", name="Show messages in this browser").click()
    section(page, "In this browser")(r"Chrome, Linux \(this browser\)")
    browsers = page.get_by_role("region", name="In this browser")
    browsers.get_by_role("checkbox", name="new rooms").uncheck()
    expect(browsers.get_by_role("status").filter(has_text="Saved.")).to_be_attached()
    push = calling.get(f"{served.url}/api/v1/notifications", headers=OWNER).json()["push"]
    assert (push["kinds"], len(push["subscriptions"])) == (["conflict", "parked"], 1)
    keep_it = {"title": "Keep Kitchen as it was", "url": "/questions?answer=accept:p1"}
    message = {"kind": "conflict", "title": "Kitchen?", "body": "37 % is gone.", "tag": "t", "url": "/questions"}
    deliver(page, message | {"actions": [keep_it]})
    shown = "navigator.serviceWorker.ready.then(r => r.getNotifications())"
    told = f"{shown}.then(all => all.map(n => [n.title, n.body, n.actions.map(a => [a.title, a.action])]))"
    assert page.evaluate(told) == [["Kitchen?", "37 % is gone.", [[keep_it["title"], keep_it["url"]]]]]
    page.get_by_role("button", name="Stop").click()
    section(page, "In this browser")("shows no messages yet")
    assert calling.get(f"{served.url}/api/v1/notifications", headers=OWNER).json()["push"]["subscriptions"] == []
    assert calling.patch(
        f"{served.url}/api/v1/notifications",
        headers=OWNER,
        json={"push": ["conflict", "parked", "room"], "language": "en"},
    ).is_success


def deliver(page: Page, message: dict[str, Any]) -> None:
    """As the browser does with what its push service brings."""
    session = page.context.new_cdp_session(page)
    found: list[str] = []
    session.on(
        "ServiceWorker.workerRegistrationUpdated",
        lambda event: found.extend(one["registrationId"] for one in event["registrations"]),
    )
    session.send("ServiceWorker.enable")
    while not found:
        page.wait_for_timeout(20)
    origin = page.evaluate("location.origin")
    data = {"origin": origin, "registrationId": found[0], "data": json.dumps(message)}
    session.send("ServiceWorker.deliverPushMessage", data)
    # A promise is true to wait_for_function before it is kept: the page itself has to look again.
    page.evaluate("""async () => {
        const registration = await navigator.serviceWorker.ready;
        const until = Date.now() + 20_000;
        while ((await registration.getNotifications()).length === 0) {
            if (Date.now() > until) throw new Error("nothing was shown");
            await new Promise((again) => setTimeout(again, 50));
        }
    }""")
