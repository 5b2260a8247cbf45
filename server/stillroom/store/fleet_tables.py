"""The tables of the fleet's figures. Days are those of the server's clock, in UTC, on which missions were processed.

A tally names robots by numbers that mean nothing by themselves, four characters each, once for each mission: so counts, numbers
of robots, and how failures gather in robots can all be had of any selection. What a home leaves behind when it is deleted is
its number.
"""

import sqlalchemy as sa

from stillroom.store.tables import BigId, UtcDateTime, metadata, mission

uncounted = sa.Table(
    "uncounted",  # missions that were processed and are not in the tallies yet
    metadata,
    sa.Column("mission_id", sa.ForeignKey("mission.id"), primary_key=True, autoincrement=False),
)

_unprocessed = mission.c.traceback.is_not(None)
sa.Index("ix_mission_unprocessed", mission.c.id, sqlite_where=_unprocessed, postgresql_where=_unprocessed)

unjudged = sa.Table(
    "unjudged",  # versions that people made, of which it is not known yet whether they correct a mission
    metadata,
    sa.Column("map_id", sa.ForeignKey("map.id"), primary_key=True, autoincrement=False),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
)

fleet_robot = sa.Table(
    "fleet_robot",
    metadata,
    sa.Column("number", BigId, primary_key=True),
    sa.Column("robot_id", sa.ForeignKey("robot.id"), nullable=False, unique=True),
    sqlite_autoincrement=True,  # a number is never given out again
)

fleet_cause = sa.Table(
    "fleet_cause",  # what missions fail by: one row a fingerprint
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("key", sa.String(16), nullable=False, unique=True),
    sa.Column("kind", sa.String(32), nullable=False),
    sa.Column("cause", sa.String(64), nullable=False),
    sa.Column("stage", sa.String(16), nullable=False),
    sa.Column("algorithm", sa.String(32), nullable=False),
    sa.Column("first_seen", UtcDateTime, nullable=False),
    sa.Column("last_seen", UtcDateTime, nullable=False),
    sa.Column("returned_at", UtcDateTime),  # when it was seen again after it had been gone
    sa.Column("muted_at", UtcDateTime),
    sa.Column("muted_until", UtcDateTime),  # null: for good
    sa.Column("muted_by", sa.String(400)),
    sa.Column("mute_note", sa.String(500)),
)

counted = sa.Table(
    "counted",  # missions that are in the tallies, and where
    metadata,
    sa.Column("mission_id", sa.ForeignKey("mission.id"), primary_key=True, autoincrement=False),
    sa.Column("robot", sa.ForeignKey("fleet_robot.number"), nullable=False),
    sa.Column("day", sa.Date, nullable=False),
    sa.Column("firmware", sa.String(100), nullable=False),
    sa.Column("model", sa.String(100), nullable=False),
    sa.Column("algorithm", sa.String(32), nullable=False),
    sa.Column("size", sa.String(8), nullable=False),
    sa.Column("outcome", sa.String(16), nullable=False),
    sa.Column("failed", sa.Integer, nullable=False),  # how many rows of the results table, the first ones
    sa.Column("cause_id", sa.ForeignKey("fleet_cause.id")),
    sa.Column("escaped_at", UtcDateTime),  # when a person corrected it
)
_failed = counted.c.cause_id.is_not(None)
sa.Index(
    "ix_counted_cause_id_mission_id",
    counted.c.cause_id,
    counted.c.mission_id,
    sqlite_where=_failed,
    postgresql_where=_failed,
)
_escaped = counted.c.escaped_at.is_not(None)
sa.Index("ix_counted_escaped", counted.c.mission_id, sqlite_where=_escaped, postgresql_where=_escaped)


def _tally(name: str) -> sa.Column[str]:
    return sa.Column(name, sa.Text, nullable=False, server_default="")


fleet_day = sa.Table(
    "fleet_day",  # the missions of a day, and which of them failed how
    metadata,
    sa.Column("day", sa.Date, primary_key=True),
    sa.Column("firmware", sa.String(100), primary_key=True),
    sa.Column("model", sa.String(100), primary_key=True),
    sa.Column("algorithm", sa.String(32), primary_key=True),
    sa.Column("size", sa.String(8), primary_key=True),
    _tally("missions"),  # those that were judged: without the parked ones
    _tally("transfer"),
    _tally("meta_occupancy"),
    _tally("meta_dividers"),
    _tally("reverted"),
    _tally("needs_review"),
    _tally("parked"),
    _tally("escapes"),
)

fleet_failure_day = sa.Table(
    "fleet_failure_day",  # the missions of a day that failed, by what
    metadata,
    sa.Column("day", sa.Date, primary_key=True),
    sa.Column("cause_id", sa.ForeignKey("fleet_cause.id"), primary_key=True, autoincrement=False),
    sa.Column("firmware", sa.String(100), primary_key=True),
    sa.Column("model", sa.String(100), primary_key=True),
    sa.Column("size", sa.String(8), primary_key=True),
    sa.Column("outcome", sa.String(16), primary_key=True),
    _tally("robots"),
)

plan_grant = sa.Table(
    "plan_grant",  # an owner's leave to look at the floor plans of a robot, or somebody's asking for it
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("key", sa.String(40), nullable=False, unique=True),
    sa.Column("robot_id", sa.ForeignKey("robot.id"), nullable=False, index=True),
    sa.Column("asked_by", sa.String(400), nullable=False),
    sa.Column("reason", sa.String(500), nullable=False),
    sa.Column("hours", sa.Integer, nullable=False),
    sa.Column("asked_at", UtcDateTime, nullable=False),
    sa.Column("answered_at", UtcDateTime),
    sa.Column("answered_by", sa.String(400)),
    sa.Column("expires_at", UtcDateTime, nullable=False),  # of the question, or once granted of the grant
    sa.Column("granted", sa.Boolean),  # null: nobody has answered
    sa.Column("ended_at", UtcDateTime),  # taken back
    sa.Column("ended_by", sa.String(400)),
)

plan_view = sa.Table(
    "plan_view",  # each time that somebody looked at a floor plan that is not theirs
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("robot_id", sa.ForeignKey("robot.id"), nullable=False),
    sa.Column("map_name", sa.String(64), nullable=False),
    sa.Column("mission", sa.String(130), nullable=False),
    sa.Column("viewer", sa.String(400), nullable=False),
    sa.Column("what", sa.String(16), nullable=False),
    sa.Column("why", sa.String(16), nullable=False),
    sa.Column("grant_id", sa.ForeignKey("plan_grant.id")),
    sa.Column("at", UtcDateTime, nullable=False),
)
sa.Index("ix_plan_view_robot_id_id", plan_view.c.robot_id, plan_view.c.id)

test_robot = sa.Table(
    "test_robot",  # whose floor plans those who run the service may always look at
    metadata,
    sa.Column("robot_id", sa.ForeignKey("robot.id"), primary_key=True),
    sa.Column("marked_by", sa.String(400), nullable=False),
    sa.Column("marked_at", UtcDateTime, nullable=False),
)

replay = sa.Table(
    "replay",  # stored missions run again with other code or other parameters, without touching anybody's map
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("name", sa.String(64), nullable=False, unique=True),
    sa.Column("algorithm", sa.String(32), nullable=False),
    sa.Column("resolvers", sa.JSON, nullable=False),
    sa.Column("params", sa.JSON, nullable=False),  # those that differ
    sa.Column("selection", sa.JSON, nullable=False),
    sa.Column("missions", sa.Integer, nullable=False),  # to be run
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("finished_at", UtcDateTime),
)

replayed = sa.Table(
    "replayed",  # what a mission came to
    metadata,
    sa.Column("replay_id", sa.ForeignKey("replay.id"), primary_key=True, autoincrement=False),
    sa.Column("mission_id", sa.ForeignKey("mission.id"), primary_key=True, autoincrement=False),
    sa.Column("outcome", sa.String(16), nullable=False),
    sa.Column("taken", sa.Boolean, nullable=False),
    sa.Column("ablation_transfer", sa.Boolean, nullable=False),
    sa.Column("ablation_meta_occupancy", sa.Boolean, nullable=False),
    sa.Column("ablation_meta_dividers", sa.Boolean, nullable=False),
    sa.Column("ms", sa.Double, nullable=False),
    sa.Column("error", sa.Text),
)

rollout = sa.Table(
    "rollout",  # another setting of the pipeline on its way to all homes
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("name", sa.String(20), nullable=False, unique=True),
    sa.Column("code", sa.String(32), nullable=False),  # version of the code that it was begun with
    sa.Column("algorithm", sa.String(64), nullable=False),  # what missions that it processes are labelled with
    sa.Column("resolvers", sa.JSON, nullable=False),
    sa.Column("params", sa.JSON, nullable=False),  # those that differ
    sa.Column("gates", sa.JSON, nullable=False),
    sa.Column("automatic", sa.Boolean, nullable=False),  # goes on by itself where its gates are passed
    sa.Column("state", sa.String(16), nullable=False),
    sa.Column("stage", sa.Integer, nullable=False),  # per cent of homes; 0: beside the setting in force
    sa.Column("staged_at", UtcDateTime, nullable=False),  # when that began
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("created_by", sa.String(400), nullable=False),
    sa.Column("ended_at", UtcDateTime),
    sa.Column("ended_by", sa.String(400)),  # null: it ended by itself
    sa.Column("reason", sa.Text),
    sa.Column("withdrawn_at", UtcDateTime),  # of one that had been successful
)
_running = rollout.c.state == "running"
sa.Index("ix_rollout_running", rollout.c.state, unique=True, sqlite_where=_running, postgresql_where=_running)

rollout_look = sa.Table(
    "rollout_look",  # each time that it was decided about a rollout, and by what numbers
    metadata,
    sa.Column("rollout_id", sa.ForeignKey("rollout.id"), primary_key=True, autoincrement=False),
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("stage", sa.Integer, nullable=False),
    sa.Column("missions", sa.Integer, nullable=False),  # of the smaller arm
    sa.Column("at", UtcDateTime, nullable=False),
    sa.Column("verdict", sa.String(16), nullable=False),
    sa.Column("gates", sa.JSON, nullable=False),
)

rolled = sa.Table(
    "rolled",  # missions of a rollout, and by which of the two settings each was processed
    metadata,
    sa.Column("rollout_id", sa.ForeignKey("rollout.id"), primary_key=True, autoincrement=False),
    sa.Column("mission_id", sa.ForeignKey("mission.id"), primary_key=True, autoincrement=False),
    sa.Column("stage", sa.Integer, nullable=False),
    sa.Column("candidate", sa.Boolean, nullable=False),
    sa.Column("due_at", sa.Double),  # of a mission that is to be run again beside: as of lanes; null: nothing to do
    sa.Column("outcome", sa.String(16)),  # what it came to beside, with the columns that follow
    sa.Column("ablation_transfer", sa.Boolean),
    sa.Column("ablation_meta_occupancy", sa.Boolean),
    sa.Column("ablation_meta_dividers", sa.Boolean),
    sa.Column("ms", sa.Double),
    sa.Column("error", sa.Text),
)
sa.Index("ix_rolled_mission_id", rolled.c.mission_id)
sa.Index("ix_rolled_arm", rolled.c.rollout_id, rolled.c.stage, rolled.c.candidate)
_beside = rolled.c.due_at.is_not(None)
sa.Index("ix_rolled_due_at", rolled.c.due_at, sqlite_where=_beside, postgresql_where=_beside)

alert_rule = sa.Table(
    "alert_rule",  # when those who run the service are told of a rate
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("name", sa.String(64), nullable=False, unique=True),
    sa.Column("measure", sa.String(16), nullable=False),
    sa.Column("selection", sa.JSON, nullable=False),
    sa.Column("days", sa.Integer, nullable=False),  # up to today
    sa.Column("minimum_n", sa.Integer, nullable=False),
    sa.Column("above", sa.Double, nullable=False),  # raised where the rate is surely higher
    sa.Column("below", sa.Double, nullable=False),  # ended where it is lower
    sa.Column("created_at", UtcDateTime, nullable=False),
    sa.Column("created_by", sa.String(400), nullable=False),
    sa.Column("looked_at", UtcDateTime),
    sa.Column("raised_at", UtcDateTime),  # null: it is not raised
    sa.Column("figures", sa.JSON(none_as_null=True)),  # by which that was last decided
)
