"""Delivers messages: tells of what happened, sends what is due, tries again what failed.

Missions never wait for it: it runs in a process of its own, with threads that wait for the network. A receiver that hangs takes
two of them at most, and one that fails is left alone for a while.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from datetime import datetime, timedelta
from email.message import EmailMessage

import structlog

from stillroom.service.messages import mail
from stillroom.service.messages.announcing import BATCH, announce
from stillroom.service.messages.attempts import Attempt
from stillroom.service.messages.keys import link_key, vapid_key
from stillroom.service.messages.outbound import TOTAL_S, Resolve, resolve
from stillroom.service.messages.review_picture import review_picture
from stillroom.service.messages.schedule import SPACING, is_over, next_try, pause
from stillroom.service.messages.sending import send_push, send_webhook
from stillroom.service.messages.topics import Topic, topics
from stillroom.service.messages.words import Words, words_of
from stillroom.settings import Messaging
from stillroom.store import clock, deliveries, receivers
from stillroom.store.database import Database, Transaction
from stillroom.store.deliveries import Change, Parcel
from stillroom.store.grids import GridStore
from stillroom.store.rows import Json, ReceiverRow

AT_ONCE = {"webhook": 20, "push": 8, "email": 4}
"""So many messages are under way: a mail server that hangs keeps no webhook waiting."""
PER_RECEIVER = 2
KEPT = timedelta(days=30)
"""So long it can be seen, and sent again, what a program was sent."""
IDLE_S = 5.0
log = structlog.get_logger()


class Messenger:
    def __init__(
        self,
        database: Database,
        grids: GridStore,
        messaging: Messaging,
        resolve: Resolve = resolve,
        total_s: float = TOTAL_S,
        finished: Callable[[], None] = lambda: None,
    ) -> None:
        """`finished` is called, from any thread, whenever there is room for another message."""
        self._database, self._grids, self._messaging = database, grids, messaging
        self._resolve, self._total_s, self._finished = resolve, total_s, finished
        self._pool = ThreadPoolExecutor(sum(AT_ONCE.values()), "messages")
        self._under_way: dict[Future[None], str] = {}
        """With the channel of each."""

    def step(self) -> float:
        """Tells of all that happened and starts to send what is due; for how many seconds there is nothing more to do."""
        while announce(self._database, self._messaging.public_url) == BATCH:
            pass
        self._under_way = {future: channel for future, channel in self._under_way.items() if not future.done()}
        busy = Counter(self._under_way.values())
        room = {channel: most - busy[channel] for channel, most in AT_ONCE.items() if busy[channel] < most}
        with self._database.look() as tx:
            due, now = deliveries.next_due(tx)
        if due is None or due > now:
            return IDLE_S if due is None else min((due - now).total_seconds(), IDLE_S)
        with self._database.write(durable=False) as tx:
            parcels = deliveries.claim(tx, now, room, PER_RECEIVER)
        for parcel in parcels:
            future = self._pool.submit(self._deliver, parcel)
            self._under_way[future] = parcel.receiver.channel
            future.add_done_callback(lambda _future: self._finished())
        # What is due and was not taken belongs to a receiver, or goes by a channel, that has as many under way as it may;
        # `finished` is called when one of them is done.
        return IDLE_S

    def settle(self) -> None:
        """Sends all that is due, and returns when that is done."""
        while True:
            self.step()
            if not self._under_way:
                return
            wait_for(self._under_way)

    def forget(self) -> None:
        """Drops what was finished long ago."""
        with self._database.write(durable=False) as tx:
            deliveries.prune(tx, clock.now(tx) - KEPT, 1000)

    def close(self) -> None:
        """Waits for what is being sent; what was not begun stays for later."""
        self._pool.shutdown(cancel_futures=True)

    def _deliver(self, parcel: Parcel) -> None:
        try:
            attempt = self._attempt(parcel)
        except Exception:  # a fault of ours must not lose the message, nor be tried without end
            log.exception("a message could not be sent", receiver=parcel.receiver.key)
            attempt = Attempt("failed", "The service could not make the message; its log says why.")
        try:
            self._record(parcel, attempt)
        except Exception:
            log.exception(
                "what became of a message could not be recorded; it is sent again", receiver=parcel.receiver.key
            )

    def _attempt(self, parcel: Parcel) -> Attempt:
        to, first, outbound = parcel.receiver, parcel.deliveries[0], self._messaging.outbound
        if to.channel == "webhook":
            return send_webhook(to, first, outbound, self._resolve, self._total_s)
        if first.kind == "confirm":
            key = link_key(self._database)
            return self._mail(mail.confirmation(to, first.key, self._messaging.public_url, key, self._words(to)))
        if to.confirmed_at is None:
            return Attempt("pointless")  # the address was changed a moment ago
        words = self._words(to)
        about = topics(self._database, parcel.deliveries, self._messaging.public_url, words)
        if not about:
            return Attempt("pointless")
        if to.channel == "push":
            return send_push(
                to, about, words, vapid_key(self._database), self._subject(), outbound, self._resolve, self._total_s
            )
        pictures = self._pictures(about)
        key = link_key(self._database)
        return self._mail(mail.letter(to, first.key, about, pictures, self._messaging.public_url, key, words))

    def _words(self, to: ReceiverRow) -> Words:
        with self._database.read() as tx:
            return words_of(receivers.language(tx, to.person))

    def _mail(self, message: EmailMessage) -> Attempt:
        if self._messaging.mail is None:
            return Attempt("failed", "The service has no mail server any more.")
        return mail.send(self._messaging.mail, message)

    def _subject(self) -> str:
        """Whom a push service can turn to."""
        server = self._messaging.mail
        return self._messaging.public_url if server is None else f"mailto:{server.sender}"

    def _pictures(self, about: Sequence[Topic]) -> list[bytes]:
        """Of the first topics, as far as they have any."""
        pictures: list[bytes] = []
        for topic in about[: mail.MOST_PICTURES]:
            if topic.conflict is None:
                break
            pictures.append(review_picture(self._database, self._grids, topic.conflict))
        return pictures

    def _record(self, parcel: Parcel, attempt: Attempt) -> None:
        with self._database.write(durable=False) as tx:
            now = clock.now(tx)
            changes = {row.id: _change(next_try(row, attempt, now), attempt, now) for row in parcel.deliveries}
            to = receivers.get(tx, parcel.receiver.id)
            if to is None or not deliveries.finish(tx, parcel, changes, now):
                return  # the receiver was removed, or the lease ran out
            if attempt.result == "gone" and to.channel == "push":
                receivers.remove(tx, to.id)
                return
            values = _consequences(to, attempt, is_personal(parcel), now)
            if values:
                receivers.change(tx, to.id, values)
            if "ended_at" in values:
                _give_up(tx, to, str(values["ended_reason"]), now)


def is_personal(parcel: Parcel) -> bool:
    """Whether it is one of the messages that people are to get few of."""
    return all(row.kind not in ("confirm", "test") for row in parcel.deliveries)


def _change(again_at: datetime | None, attempt: Attempt, now: datetime) -> Change:
    state = {"delivered": "delivered", "pointless": "dropped"}.get(attempt.result)
    if state is None:
        state = "dead" if again_at is None else "waiting"
    return Change(state, again_at or now, attempt.status_code, attempt.reason)


def _consequences(to: ReceiverRow, attempt: Attempt, personal: bool, now: datetime) -> Json:
    """What an attempt changes about its receiver."""
    match attempt.result:
        case "pointless":
            return {}
        case "delivered":
            rest = SPACING[to.channel] if personal else timedelta()
            return {"delivered_at": now, "failures": 0, "failing_since": None, "resume_at": now + rest}
        case "gone":
            return {"ended_at": now, "ended_reason": attempt.reason}
    failures = to.failures + 1
    failing: Json = {
        "failures": failures,
        "failing_since": to.failing_since or now,
        "resume_at": now + max(pause(failures), timedelta(seconds=attempt.retry_after_s or 0.0)),
    }
    if is_over(to, failures, now):
        days = (now - failing["failing_since"]).days
        failing |= {"ended_at": now, "ended_reason": f"It took no message for {days} days. Last: {attempt.reason}"}
    return failing


def _give_up(tx: Transaction, to: ReceiverRow, reason: str, now: datetime) -> None:
    log.warning("a receiver of messages is given up", receiver=to.key, reason=reason)
    deliveries.give_up(tx, to.id, reason, now)
