"""stored missions run again with other code or other parameters"""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

BIG_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "replay",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("name", sa.String(64), nullable=False),
        sa.Column("algorithm", sa.String(32), nullable=False),
        sa.Column("resolvers", sa.JSON(), nullable=False),
        sa.Column("params", sa.JSON(), nullable=False),
        sa.Column("selection", sa.JSON(), nullable=False),
        sa.Column("missions", sa.Integer(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("finished_at", MOMENT, nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_replay")),
        sa.UniqueConstraint("name", name=op.f("uq_replay_name")),
    )
    op.create_table(
        "replayed",
        sa.Column("replay_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("mission_id", BIG_ID, autoincrement=False, nullable=False),
        sa.Column("outcome", sa.String(16), nullable=False),
        sa.Column("taken", sa.Boolean(), nullable=False),
        sa.Column("ablation_transfer", sa.Boolean(), nullable=False),
        sa.Column("ablation_meta_occupancy", sa.Boolean(), nullable=False),
        sa.Column("ablation_meta_dividers", sa.Boolean(), nullable=False),
        sa.Column("ms", sa.Double(), nullable=False),
        sa.Column("error", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["replay_id"], ["replay.id"], name=op.f("fk_replayed_replay_id_replay")),
        sa.ForeignKeyConstraint(["mission_id"], ["mission.id"], name=op.f("fk_replayed_mission_id_mission")),
        sa.PrimaryKeyConstraint("replay_id", "mission_id", name=op.f("pk_replayed")),
    )


def downgrade() -> None:
    op.drop_table("replayed")
    op.drop_table("replay")
