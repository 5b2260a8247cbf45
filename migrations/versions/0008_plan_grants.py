"""who may look at floor plans that are not theirs, and who did"""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

BIG_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "plan_grant",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("key", sa.String(40), nullable=False),
        sa.Column("robot_id", sa.String(64), nullable=False),
        sa.Column("asked_by", sa.String(400), nullable=False),
        sa.Column("reason", sa.String(500), nullable=False),
        sa.Column("hours", sa.Integer(), nullable=False),
        sa.Column("asked_at", MOMENT, nullable=False),
        sa.Column("answered_at", MOMENT, nullable=True),
        sa.Column("answered_by", sa.String(400), nullable=True),
        sa.Column("expires_at", MOMENT, nullable=False),
        sa.Column("granted", sa.Boolean(), nullable=True),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.Column("ended_by", sa.String(400), nullable=True),
        sa.ForeignKeyConstraint(["robot_id"], ["robot.id"], name=op.f("fk_plan_grant_robot_id_robot")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_plan_grant")),
        sa.UniqueConstraint("key", name=op.f("uq_plan_grant_key")),
    )
    op.create_index(op.f("ix_plan_grant_robot_id"), "plan_grant", ["robot_id"])
    op.create_table(
        "plan_view",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("robot_id", sa.String(64), nullable=False),
        sa.Column("map_name", sa.String(64), nullable=False),
        sa.Column("mission", sa.String(130), nullable=False),
        sa.Column("viewer", sa.String(400), nullable=False),
        sa.Column("what", sa.String(16), nullable=False),
        sa.Column("why", sa.String(16), nullable=False),
        sa.Column("grant_id", BIG_ID, nullable=True),
        sa.Column("at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["robot_id"], ["robot.id"], name=op.f("fk_plan_view_robot_id_robot")),
        sa.ForeignKeyConstraint(["grant_id"], ["plan_grant.id"], name=op.f("fk_plan_view_grant_id_plan_grant")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_plan_view")),
    )
    op.create_index("ix_plan_view_robot_id_id", "plan_view", ["robot_id", "id"])
    op.create_table(
        "test_robot",
        sa.Column("robot_id", sa.String(64), nullable=False),
        sa.Column("marked_by", sa.String(400), nullable=False),
        sa.Column("marked_at", MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["robot_id"], ["robot.id"], name=op.f("fk_test_robot_robot_id_robot")),
        sa.PrimaryKeyConstraint("robot_id", name=op.f("pk_test_robot")),
    )


def downgrade() -> None:
    for table in ("test_robot", "plan_view", "plan_grant"):
        op.drop_table(table)
