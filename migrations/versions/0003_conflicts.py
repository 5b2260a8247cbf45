"""conflicts: what missions found, what was proposed, and how each ended"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

BIG_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")


def upgrade() -> None:
    op.create_table(
        "conflict",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("map_id", BIG_ID, nullable=False),
        sa.Column("key", sa.String(200), nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("place", sa.String(64), nullable=False),
        sa.Column("resolved", sa.Boolean(), nullable=False),
        sa.Column("opened_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("due_at", sa.DateTime(timezone=True), nullable=True),
        sa.Column("waits", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["map_id"], ["map.id"], name=op.f("fk_conflict_map_id_map")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_conflict")),
        sa.UniqueConstraint("map_id", "key", name=op.f("uq_conflict_map_id_key")),
    )
    op.create_index(
        "ix_conflict_due_at",
        "conflict",
        ["due_at"],
        sqlite_where=sa.text("waits"),
        postgresql_where=sa.text("waits"),
    )
    op.create_table(
        "sighting",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("conflict_id", BIG_ID, nullable=False),
        sa.Column("mission_id", BIG_ID, nullable=False),
        sa.Column("cause", sa.String(32), nullable=False),
        sa.Column("summary", sa.Text(), nullable=False),
        sa.Column("rooms", sa.JSON(), nullable=False),
        sa.Column("dividers", sa.JSON(), nullable=False),
        sa.Column("restrictions", sa.JSON(), nullable=False),
        sa.Column("base_version", sa.Integer(), nullable=False),
        sa.Column("motion", sa.JSON(none_as_null=True), nullable=True),
        sa.ForeignKeyConstraint(["conflict_id"], ["conflict.id"], name=op.f("fk_sighting_conflict_id_conflict")),
        sa.ForeignKeyConstraint(["mission_id"], ["mission.id"], name=op.f("fk_sighting_mission_id_mission")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_sighting")),
        sa.UniqueConstraint("conflict_id", "mission_id", name=op.f("uq_sighting_conflict_id_mission_id")),
    )
    op.create_index(op.f("ix_sighting_mission_id"), "sighting", ["mission_id"])
    op.create_table(
        "proposal",
        sa.Column("sighting_id", BIG_ID, nullable=False),
        sa.Column("name", sa.String(16), nullable=False),
        sa.Column("action", sa.String(16), nullable=False),
        sa.Column("recommended", sa.Boolean(), nullable=False),
        sa.Column("changes", sa.JSON(), nullable=False),
        sa.Column("document", sa.JSON(), nullable=False),
        sa.Column("used_ids", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(["sighting_id"], ["sighting.id"], name=op.f("fk_proposal_sighting_id_sighting")),
        sa.PrimaryKeyConstraint("sighting_id", "name", name=op.f("pk_proposal")),
    )
    op.create_table(
        "ending",
        sa.Column("conflict_id", BIG_ID, nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("response", sa.String(16), nullable=True),
        sa.Column("proposal", sa.String(16), nullable=True),
        sa.Column("dividers", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("note", sa.Text(), nullable=True),
        sa.Column("decided_by", sa.String(400), nullable=False),
        sa.Column("decided_at", sa.DateTime(timezone=True), nullable=False),
        sa.Column("version", sa.Integer(), nullable=True),
        sa.Column("mission_id", BIG_ID, nullable=True),
        sa.ForeignKeyConstraint(["conflict_id"], ["conflict.id"], name=op.f("fk_ending_conflict_id_conflict")),
        sa.ForeignKeyConstraint(["mission_id"], ["mission.id"], name=op.f("fk_ending_mission_id_mission")),
        sa.PrimaryKeyConstraint("conflict_id", name=op.f("pk_ending")),
    )


def downgrade() -> None:
    op.drop_table("ending")
    op.drop_table("proposal")
    op.drop_index(op.f("ix_sighting_mission_id"), "sighting")
    op.drop_table("sighting")
    op.drop_index("ix_conflict_due_at", "conflict")
    op.drop_table("conflict")
