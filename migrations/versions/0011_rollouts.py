"""rollouts, and alerts on rates"""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None

BIG_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "rollout",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("name", sa.String(20), nullable=False),
        sa.Column("code", sa.String(32), nullable=False),
        sa.Column("algorithm", sa.String(64), nullable=False),
        sa.Column("resolvers", sa.JSON(), nullable=False),
        sa.Column("params", sa.JSON(), nullable=False),
        sa.Column("gates", sa.JSON(), nullable=False),
        sa.Column("automatic", sa.Boolean(), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("stage", sa.Integer(), nullable=False),
        sa.Column("staged_at", MOMENT, nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by", sa.String(400), nullable=False),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.Column("ended_by", sa.String(400), nullable=True),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.Column("withdrawn_at", MOMENT, nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_rollout")),
        sa.UniqueConstraint("name", name=op.f("uq_rollout_name")),
    )
    running = sa.text("state = 'running'")
    op.create_index(
        "ix_rollout_running", "rollout", ["state"], unique=True, sqlite_where=running, postgresql_where=running
    )
    op.create_table(
        "rollout_look",
        sa.Column("rollout_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("number", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("stage", sa.Integer(), nullable=False),
        sa.Column("missions", sa.Integer(), nullable=False),
        sa.Column("at", MOMENT, nullable=False),
        sa.Column("verdict", sa.String(16), nullable=False),
        sa.Column("gates", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(["rollout_id"], ["rollout.id"], name=op.f("fk_rollout_look_rollout_id_rollout")),
        sa.PrimaryKeyConstraint("rollout_id", "number", name=op.f("pk_rollout_look")),
    )
    op.create_table(
        "rolled",
        sa.Column("rollout_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("mission_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("stage", sa.Integer(), nullable=False),
        sa.Column("candidate", sa.Boolean(), nullable=False),
        sa.Column("due_at", sa.Double(), nullable=True),
        sa.Column("outcome", sa.String(16), nullable=True),
        sa.Column("ablation_transfer", sa.Boolean(), nullable=True),
        sa.Column("ablation_meta_occupancy", sa.Boolean(), nullable=True),
        sa.Column("ablation_meta_dividers", sa.Boolean(), nullable=True),
        sa.Column("ms", sa.Double(), nullable=True),
        sa.Column("error", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["rollout_id"], ["rollout.id"], name=op.f("fk_rolled_rollout_id_rollout")),
        sa.ForeignKeyConstraint(["mission_id"], ["mission.id"], name=op.f("fk_rolled_mission_id_mission")),
        sa.PrimaryKeyConstraint("rollout_id", "mission_id", name=op.f("pk_rolled")),
    )
    op.create_index("ix_rolled_mission_id", "rolled", ["mission_id"])
    op.create_index("ix_rolled_arm", "rolled", ["rollout_id", "stage", "candidate"])
    beside = sa.text("due_at IS NOT NULL")
    op.create_index("ix_rolled_due_at", "rolled", ["due_at"], sqlite_where=beside, postgresql_where=beside)
    op.create_table(
        "alert_rule",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("measure", sa.String(16), nullable=False),
        sa.Column("selection", sa.JSON(), nullable=False),
        sa.Column("days", sa.Integer(), nullable=False),
        sa.Column("minimum_n", sa.Integer(), nullable=False),
        sa.Column("above", sa.Double(), nullable=False),
        sa.Column("below", sa.Double(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("created_by", sa.String(400), nullable=False),
        sa.Column("looked_at", MOMENT, nullable=True),
        sa.Column("raised_at", MOMENT, nullable=True),
        sa.Column("figures", sa.JSON(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_alert_rule")),
        sa.UniqueConstraint("name", name=op.f("uq_alert_rule_name")),
    )


def downgrade() -> None:
    for table in ("alert_rule", "rolled", "rollout_look", "rollout"):
        op.drop_table(table)
