"""The tables. Rows are facts: versions, sightings, endings, events and finished missions are never changed."""

import zlib
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from pydantic_core import from_json, to_json

metadata = sa.MetaData(
    naming_convention={
        "ix": "ix_%(column_0_label)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s_%(referred_table_name)s",
        "pk": "pk_%(table_name)s",
    }
)

BigId = sa.BigInteger().with_variant(sa.Integer, "sqlite")


class UtcDateTime(sa.types.TypeDecorator[datetime]):
    """A moment; aware and in UTC on our side, whatever the engine keeps."""

    impl = sa.DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: sa.Dialect) -> datetime | None:
        if value is None:
            return None
        moment = value.astimezone(UTC)
        return moment.replace(tzinfo=None) if dialect.name == "sqlite" else moment

    def process_result_value(self, value: datetime | None, _dialect: sa.Dialect) -> datetime | None:
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


_FAST = 1
"""Of zlib's levels: the best would take three times as long for a tenth less."""


class PackedJson(sa.types.TypeDecorator[Any]):
    """A large document: compressed here, a database would do it at greater cost and half as well."""

    impl = sa.LargeBinary
    cache_ok = True

    def process_bind_param(self, value: Any, _dialect: sa.Dialect) -> bytes | None:
        if value is None:
            return None
        return zlib.compress(to_json(value), _FAST)

    def process_result_value(self, value: bytes | None, _dialect: sa.Dialect) -> Any:
        return None if value is None else from_json(zlib.decompress(value))


robot = sa.Table(
    "robot",
    metadata,
    sa.Column("id", sa.String(64), primary_key=True),
    sa.Column("name", sa.String(200), nullable=False),
    sa.Column("owner", sa.String(320), index=True),
    sa.Column("token_hash", sa.String(64), nullable=False, unique=True),
    sa.Column("claim_code_hash", sa.String(64), nullable=False, index=True),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("token_made_at", UtcDateTime),  # null: it was revoked, and `token_hash` is nobody's
    sa.Column(
        "token_shown", sa.Boolean, nullable=False, server_default=sa.false()
    ),  # to an owner: not for the next one
    sa.Column("released_at", UtcDateTime),  # its owner gave it up, and nobody has claimed it since
    sa.Column("kept_from", sa.String(64)),  # the robot whose maps these were until its owner gave it up
)

map_ = sa.Table(
    "map",
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("robot_id", sa.ForeignKey("robot.id"), nullable=False),
    sa.Column("name", sa.String(64), nullable=False),  # the robot's own name of the floor
    sa.Column("title", sa.String(200), nullable=False),  # what people call it
    sa.Column("ordinal", sa.Integer, nullable=False),  # 1 for a robot's first map
    sa.Column("review", sa.String(16), nullable=False),
    sa.Column("head", sa.Integer),  # number of the version in force
    sa.Column("epoch", sa.BigInteger),  # of the newest mission that was processed
    sa.Column("sequence", sa.BigInteger),
    sa.Column("used_ids", sa.JSON, nullable=False),  # how many ids were given out, by kind
    sa.Column("pinned", sa.Integer),  # number of the version that it stays at until a person agrees to another
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.UniqueConstraint("robot_id", "name"),
    sa.UniqueConstraint("robot_id", "ordinal"),
)

lane = sa.Table(
    "lane",
    metadata,
    sa.Column("map_id", sa.ForeignKey("map.id"), primary_key=True),
    sa.Column("ready_at", sa.Double),  # seconds since 1970; while claimed, the end of the lease; null: nothing to do
    sa.Column("claim", sa.String(32)),
)
sa.Index(
    "ix_lane_ready_at",
    lane.c.ready_at,
    sqlite_where=lane.c.ready_at.is_not(None),
    postgresql_where=lane.c.ready_at.is_not(None),
)

mission = sa.Table(
    "mission",
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("map_id", sa.ForeignKey("map.id"), nullable=False),
    sa.Column(
        "key", sa.String(130), nullable=False
    ),  # the robot's own id of the mission; where it was placed, see placed_key
    sa.Column("epoch", sa.BigInteger, nullable=False),
    sa.Column("sequence", sa.BigInteger, nullable=False),
    sa.Column("status", sa.String(16), nullable=False),
    sa.Column("attempts", sa.Integer, nullable=False),
    sa.Column("grid", sa.String(64), nullable=False),  # SHA-256 of the bytes that were sent
    sa.Column("meta", sa.JSON, nullable=False),  # as it was sent
    sa.Column("meta_digest", sa.String(64), nullable=False),
    sa.Column("received_at", UtcDateTime, nullable=False),
    sa.Column("finished_at", UtcDateTime),
    sa.Column("outcome", sa.String(16)),
    sa.Column("succeeded_at", sa.String(16)),
    sa.Column("ablation_transfer", sa.Boolean),
    sa.Column("ablation_meta_occupancy", sa.Boolean),
    sa.Column("ablation_meta_dividers", sa.Boolean),
    sa.Column("base_version", sa.Integer),  # the one that was carried over
    sa.Column("version", sa.Integer),  # the one in force afterwards
    sa.Column("algorithm", sa.String(32)),
    sa.Column("result", sa.JSON),
    sa.Column("traceback", sa.Text),
    sa.Column("placed_from", sa.ForeignKey("mission.id"), index=True),  # the parked mission that a person put here
    sa.Column("placed_by", sa.String(400)),
    sa.UniqueConstraint("map_id", "key"),
)
_unfinished = mission.c.status != "done"
sa.Index(
    "ix_mission_unfinished",
    mission.c.map_id,
    mission.c.epoch,
    mission.c.sequence,
    mission.c.id,
    sqlite_where=_unfinished,
    postgresql_where=_unfinished,
)
sa.Index("ix_mission_outcome", mission.c.outcome)

version = sa.Table(
    "version",
    metadata,
    sa.Column("map_id", sa.ForeignKey("map.id"), primary_key=True),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("parent", sa.Integer),
    sa.Column("cause", sa.String(16), nullable=False),
    sa.Column("mission", sa.String(130)),  # key of the mission whose grid this version lies on
    sa.Column("made_by", sa.String(400), nullable=False),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("algorithm", sa.String(32), nullable=False),
    sa.Column("grid", sa.String(64), nullable=False),  # SHA-256 of the bytes that were sent
    sa.Column("frame_from", sa.Integer),  # the version whose frame was carried over to this one
    sa.Column("motion", sa.JSON(none_as_null=True)),  # from that frame to this one; null: the same frame
    sa.Column("rooms", sa.Integer, nullable=False),
    sa.Column("packed", PackedJson),  # the map
    sa.Column("document", sa.JSON(none_as_null=True)),  # the map, of versions that an older program wrote
    sa.Column("name", sa.String(100)),  # what people call it: the only thing of a version that may change
)

room = sa.Table(
    "room",
    metadata,
    sa.Column("map_id", sa.ForeignKey("map.id"), primary_key=True),
    sa.Column("id", sa.String(64), primary_key=True),
    sa.Column("segment_id", sa.Integer, nullable=False),
    sa.Column("name", sa.String(200), nullable=False),  # the last it had
    sa.Column("retired", sa.Boolean, nullable=False),
    sa.Column("survivor", sa.String(64)),  # the room that took its space
    sa.UniqueConstraint("map_id", "segment_id"),
)

conflict = sa.Table(
    "conflict",
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("map_id", sa.ForeignKey("map.id"), nullable=False),
    sa.Column("key", sa.String(200), nullable=False),  # what it is called, for ever
    sa.Column("kind", sa.String(32), nullable=False),
    sa.Column("place", sa.String(64), nullable=False),  # SHA-256 of what it is about: equal for a repeat
    sa.Column("resolved", sa.Boolean, nullable=False),  # the meta layer settled it: nobody has to answer
    sa.Column("opened_at", UtcDateTime, nullable=False),
    sa.Column("due_at", UtcDateTime),  # when the default answer takes effect; null: nobody is asked
    sa.Column("waits", sa.Boolean, nullable=False),  # for an answer, or for that moment
    sa.Column(
        "quiet", sa.Boolean, nullable=False, server_default=sa.false()
    ),  # the same was dismissed before: no message
    sa.UniqueConstraint("map_id", "key"),
)
_waiting = conflict.c.waits
sa.Index("ix_conflict_due_at", conflict.c.due_at, sqlite_where=_waiting, postgresql_where=_waiting)

sighting = sa.Table(
    "sighting",
    metadata,
    sa.Column("id", BigId, primary_key=True),  # the newest of a conflict has the highest
    sa.Column("conflict_id", sa.ForeignKey("conflict.id"), nullable=False),
    sa.Column("mission_id", sa.ForeignKey("mission.id"), nullable=False, index=True),
    sa.Column("cause", sa.String(32), nullable=False),
    sa.Column("summary", sa.Text, nullable=False),
    sa.Column("rooms", sa.JSON, nullable=False),  # precision and recall of each
    sa.Column("dividers", sa.JSON, nullable=False),  # ids
    sa.Column("restrictions", sa.JSON, nullable=False),
    sa.Column("base_version", sa.Integer, nullable=False),  # the one in force that its proposals would replace
    sa.Column("motion", sa.JSON(none_as_null=True)),  # from that version's frame to the mission's
    sa.UniqueConstraint("conflict_id", "mission_id"),
)

proposal = sa.Table(
    "proposal",
    metadata,
    sa.Column("sighting_id", sa.ForeignKey("sighting.id"), primary_key=True),
    sa.Column("name", sa.String(16), primary_key=True),  # "p1"
    sa.Column("action", sa.String(16), nullable=False),
    sa.Column("recommended", sa.Boolean, nullable=False),
    sa.Column("changes", sa.JSON, nullable=False),  # a map of nothing but what it proposes
    sa.Column("document", sa.JSON, nullable=False),  # the map that would be in force
    sa.Column("used_ids", sa.JSON, nullable=False),
)

ending = sa.Table(
    "ending",  # how a conflict ended: at most one each
    metadata,
    sa.Column("conflict_id", sa.ForeignKey("conflict.id"), primary_key=True),
    sa.Column("state", sa.String(16), nullable=False),
    sa.Column("response", sa.String(16)),  # null: nobody answered
    sa.Column("proposal", sa.String(16)),
    sa.Column("dividers", sa.JSON(none_as_null=True)),
    sa.Column("note", sa.Text),
    sa.Column("decided_by", sa.String(400), nullable=False),
    sa.Column("decided_at", UtcDateTime, nullable=False),
    sa.Column("version", sa.Integer),  # the one in force afterwards
    sa.Column("mission_id", sa.ForeignKey("mission.id")),  # the later one that superseded it
)

event = sa.Table(
    "event",
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("robot_id", sa.ForeignKey("robot.id"), nullable=False),
    sa.Column("map_id", sa.ForeignKey("map.id"), nullable=False),
    sa.Column("kind", sa.String(32), nullable=False),
    sa.Column("data", sa.JSON, nullable=False),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sqlite_autoincrement=True,
)
sa.Index("ix_event_robot_id_id", event.c.robot_id, event.c.id)

account = sa.Table(
    "account",
    metadata,
    sa.Column("email", sa.String(320), primary_key=True),  # in lower case
    sa.Column("key", sa.String(40), nullable=False, unique=True),  # what the API calls it
    sa.Column("password_hash", sa.Text),  # null: signs in otherwise
    sa.Column("duty", sa.String(16)),  # operator or engineer; null: neither
    sa.Column("issuer", sa.String(300)),  # OpenID Connect: whose word this person signed in by first, and
    sa.Column("subject", sa.String(255)),  # who they are there; no other may take the e-mail address for theirs
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("disabled_at", UtcDateTime),
)

session = sa.Table(
    "session",
    metadata,
    sa.Column("hash", sa.String(64), primary_key=True),
    sa.Column("key", sa.String(40), nullable=False, unique=True),
    sa.Column("email", sa.String(320), index=True),  # null: an operator who has no account
    sa.Column("way", sa.String(16), nullable=False),  # how this browser was signed in
    sa.Column("agent", sa.String(300), nullable=False),  # what the browser says it is
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("seen_at", UtcDateTime, nullable=False),
    sa.Column("expires_at", UtcDateTime, nullable=False),
)

link = sa.Table(
    "link",  # works once
    metadata,
    sa.Column("hash", sa.String(64), primary_key=True),
    sa.Column("key", sa.String(40), nullable=False, unique=True),
    sa.Column("purpose", sa.String(16), nullable=False),
    sa.Column("email", sa.String(320), index=True),  # null: an operator who has no account
    sa.Column("home", sa.String(320), index=True),  # whose home it is that somebody is invited to
    sa.Column("role", sa.String(16)),  # in that home
    sa.Column("duty", sa.String(16)),
    sa.Column("made_by", sa.String(400)),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("expires_at", UtcDateTime, nullable=False),
    sa.Column("used_at", UtcDateTime),
)

membership = sa.Table(
    "membership",  # of people in homes that are not theirs
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("key", sa.String(40), nullable=False, unique=True),
    sa.Column("home", sa.String(320), nullable=False),  # whose it is
    sa.Column("email", sa.String(320), nullable=False, index=True),
    sa.Column("role", sa.String(16), nullable=False),
    sa.Column("since", UtcDateTime, nullable=False),
    sa.UniqueConstraint("home", "email"),
)

api_token = sa.Table(
    "api_token",  # of people, for their programs
    metadata,
    sa.Column("hash", sa.String(64), primary_key=True),
    sa.Column("key", sa.String(40), nullable=False, unique=True),
    sa.Column("email", sa.String(320), nullable=False, index=True),
    sa.Column("name", sa.String(100), nullable=False),
    sa.Column("scopes", sa.JSON, nullable=False),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("expires_at", UtcDateTime),
    sa.Column("seen_at", UtcDateTime),
)

throttle = sa.Table(
    "throttle",  # what was tried too often, by whom
    metadata,
    sa.Column("key", sa.String(64), primary_key=True),  # SHA-256 of what and by whom
    sa.Column("count", sa.Integer, nullable=False),
    sa.Column("open_at", UtcDateTime, nullable=False),  # nothing is let through before
    sa.Column("forget_at", UtcDateTime, nullable=False, index=True),
)

preference = sa.Table(
    "preference",  # what a person wants to be told by a channel; without a row, everything
    metadata,
    sa.Column("person", sa.String(400), primary_key=True),  # as versions name who made them
    sa.Column("channel", sa.String(8), primary_key=True),
    sa.Column("kinds", sa.JSON, nullable=False),
)

language = sa.Table(
    "language",  # in which a person is told
    metadata,
    sa.Column("person", sa.String(400), primary_key=True),
    sa.Column("language", sa.String(8), nullable=False),
)

receiver = sa.Table(
    "receiver",  # where messages go: a person's address or browser, or a program's URL
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("key", sa.String(40), nullable=False, unique=True),  # what the API calls it
    sa.Column("channel", sa.String(8), nullable=False),
    sa.Column("person", sa.String(400), nullable=False, index=True),  # whose it is
    sa.Column("fleet", sa.Boolean, nullable=False),  # told about all robots, whoever owns them
    sa.Column("address", sa.Text, nullable=False),  # e-mail address or URL
    sa.Column("digest", sa.String(64), nullable=False),  # SHA-256 of the address
    sa.Column("label", sa.String(200), nullable=False),
    sa.Column("kinds", sa.JSON(none_as_null=True)),  # of a webhook: the types it takes; null: all
    sa.Column("keys", sa.JSON, nullable=False),  # what messages are signed or encrypted with
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("confirmed_at", UtcDateTime),  # null: nothing but the question whether it is right goes there
    sa.Column("delivered_at", UtcDateTime),
    sa.Column("failures", sa.Integer, nullable=False),  # on end
    sa.Column("failing_since", UtcDateTime),
    sa.Column("resume_at", UtcDateTime),  # nothing is sent before
    sa.Column("ended_at", UtcDateTime),  # nothing is sent any more
    sa.Column("ended_reason", sa.Text),
)
sa.Index(
    "ix_receiver_email",
    receiver.c.person,
    unique=True,
    sqlite_where=receiver.c.channel == "email",
    postgresql_where=receiver.c.channel == "email",
)
sa.Index(
    "ix_receiver_push",
    receiver.c.digest,
    unique=True,
    sqlite_where=receiver.c.channel == "push",
    postgresql_where=receiver.c.channel == "push",
)

outbox = sa.Table(
    "outbox",  # events that nobody has been told of yet
    metadata,
    sa.Column("event_id", sa.ForeignKey("event.id"), primary_key=True, autoincrement=False),
)

delivery = sa.Table(
    "delivery",  # one message, or part of one, to one receiver
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("key", sa.String(40), nullable=False),  # what the receiver knows it by; equal for a replay
    sa.Column("receiver_id", sa.ForeignKey("receiver.id"), nullable=False),
    sa.Column("kind", sa.String(32), nullable=False),
    sa.Column("content", sa.JSON, nullable=False),
    sa.Column("state", sa.String(12), nullable=False),
    sa.Column("attempts", sa.Integer, nullable=False),
    sa.Column("due_at", UtcDateTime, nullable=False),  # while claimed, the end of the lease
    sa.Column("claim", sa.String(32)),
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("tried_at", UtcDateTime),
    sa.Column("finished_at", UtcDateTime),
    sa.Column("status_code", sa.Integer),  # of the last answer
    sa.Column("reason", sa.Text),  # why it failed last
)
_underway = delivery.c.state == "waiting"
sa.Index("ix_delivery_due_at", delivery.c.due_at, sqlite_where=_underway, postgresql_where=_underway)
sa.Index("ix_delivery_receiver_id_id", delivery.c.receiver_id, delivery.c.id)
sa.Index("ix_delivery_finished_at", delivery.c.finished_at)

service_key = sa.Table(
    "service_key",  # secrets that all machines of the service share
    metadata,
    sa.Column("name", sa.String(32), primary_key=True),
    sa.Column("value", sa.Text, nullable=False),
)
