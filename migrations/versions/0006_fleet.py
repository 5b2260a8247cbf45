"""the fleet's figures: tallies by day, and what missions fail by"""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

BIG_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
MOMENT = sa.DateTime(timezone=True)


def _tally(name: str) -> sa.Column[str]:
    return sa.Column(name, sa.Text(), server_default="", nullable=False)


def upgrade() -> None:
    op.create_table(
        "uncounted",
        sa.Column("mission_id", BIG_ID, autoincrement=False, nullable=False),
        sa.ForeignKeyConstraint(["mission_id"], ["mission.id"], name=op.f("fk_uncounted_mission_id_mission")),
        sa.PrimaryKeyConstraint("mission_id", name=op.f("pk_uncounted")),
    )
    op.create_table(
        "unjudged",
        sa.Column("map_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.ForeignKeyConstraint(["map_id"], ["map.id"], name=op.f("fk_unjudged_map_id_map")),
        sa.PrimaryKeyConstraint("map_id", "number", name=op.f("pk_unjudged")),
    )
    op.create_table(
        "fleet_robot",
        sa.Column("number", BIG_ID, nullable=False),
        sa.Column("robot_id", sa.String(64), nullable=False),
        sa.ForeignKeyConstraint(["robot_id"], ["robot.id"], name=op.f("fk_fleet_robot_robot_id_robot")),
        sa.PrimaryKeyConstraint("number", name=op.f("pk_fleet_robot")),
        sa.UniqueConstraint("robot_id", name=op.f("uq_fleet_robot_robot_id")),
        sqlite_autoincrement=True,
    )
    op.create_table(
        "fleet_cause",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("key", sa.String(16), nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("cause", sa.String(64), nullable=False),
        sa.Column("stage", sa.String(16), nullable=False),
        sa.Column("algorithm", sa.String(32), nullable=False),
        sa.Column("first_seen", MOMENT, nullable=False),
        sa.Column("last_seen", MOMENT, nullable=False),
        sa.Column("returned_at", MOMENT, nullable=True),
        sa.Column("muted_at", MOMENT, nullable=True),
        sa.Column("muted_until", MOMENT, nullable=True),
        sa.Column("muted_by", sa.String(400), nullable=True),
        sa.Column("mute_note", sa.String(500), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_fleet_cause")),
        sa.UniqueConstraint("key", name=op.f("uq_fleet_cause_key")),
    )
    op.create_table(
        "counted",
        sa.Column("mission_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("robot", BIG_ID, nullable=False),
        sa.Column("day", sa.Date(), nullable=False),
        sa.Column("firmware", sa.String(100), nullable=False),
        sa.Column("model", sa.String(100), nullable=False),
        sa.Column("algorithm", sa.String(32), nullable=False),
        sa.Column("size", sa.String(8), nullable=False),
        sa.Column("outcome", sa.String(16), nullable=False),
        sa.Column("failed", sa.Integer(), nullable=False),
        sa.Column("cause_id", BIG_ID, nullable=True),
        sa.Column("escaped_at", MOMENT, nullable=True),
        sa.ForeignKeyConstraint(["mission_id"], ["mission.id"], name=op.f("fk_counted_mission_id_mission")),
        sa.ForeignKeyConstraint(["robot"], ["fleet_robot.number"], name=op.f("fk_counted_robot_fleet_robot")),
        sa.ForeignKeyConstraint(["cause_id"], ["fleet_cause.id"], name=op.f("fk_counted_cause_id_fleet_cause")),
        sa.PrimaryKeyConstraint("mission_id", name=op.f("pk_counted")),
    )
    failed = sa.text("cause_id IS NOT NULL")
    op.create_index(
        "ix_counted_cause_id_mission_id",
        "counted",
        ["cause_id", "mission_id"],
        sqlite_where=failed,
        postgresql_where=failed,
    )
    escaped = sa.text("escaped_at IS NOT NULL")
    op.create_index("ix_counted_escaped", "counted", ["mission_id"], sqlite_where=escaped, postgresql_where=escaped)
    op.create_table(
        "fleet_day",
        sa.Column("day", sa.Date(), nullable=False),
        sa.Column("firmware", sa.String(100), nullable=False),
        sa.Column("model", sa.String(100), nullable=False),
        sa.Column("algorithm", sa.String(32), nullable=False),
        sa.Column("size", sa.String(8), nullable=False),
        _tally("missions"),
        _tally("transfer"),
        _tally("meta_occupancy"),
        _tally("meta_dividers"),
        _tally("reverted"),
        _tally("needs_review"),
        _tally("parked"),
        _tally("escapes"),
        sa.PrimaryKeyConstraint("day", "firmware", "model", "algorithm", "size", name=op.f("pk_fleet_day")),
    )
    op.create_table(
        "fleet_failure_day",
        sa.Column("day", sa.Date(), nullable=False),
        sa.Column("cause_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("firmware", sa.String(100), nullable=False),
        sa.Column("model", sa.String(100), nullable=False),
        sa.Column("size", sa.String(8), nullable=False),
        sa.Column("outcome", sa.String(16), nullable=False),
        _tally("robots"),
        sa.ForeignKeyConstraint(
            ["cause_id"], ["fleet_cause.id"], name=op.f("fk_fleet_failure_day_cause_id_fleet_cause")
        ),
        sa.PrimaryKeyConstraint(
            "day", "cause_id", "firmware", "model", "size", "outcome", name=op.f("pk_fleet_failure_day")
        ),
    )
    # what there is already is counted like what comes
    op.execute("INSERT INTO uncounted (mission_id) SELECT id FROM mission WHERE status = 'done'")
    op.execute(
        "INSERT INTO unjudged (map_id, number) SELECT map_id, number FROM version"
        " WHERE cause IN ('edit', 'restore', 'decision')"
    )


def downgrade() -> None:
    for table in ("fleet_failure_day", "fleet_day", "counted", "fleet_cause", "fleet_robot", "unjudged", "uncounted"):
        op.drop_table(table)
