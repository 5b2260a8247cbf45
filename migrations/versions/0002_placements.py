"""placements: a parked mission as a mission of the floor that a person says"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("mission") as mission:
        mission.alter_column("key", existing_type=sa.String(64), type_=sa.String(130), existing_nullable=False)
        mission.add_column(sa.Column("placed_from", sa.BigInteger().with_variant(sa.Integer, "sqlite"), nullable=True))
        mission.add_column(sa.Column("placed_by", sa.String(400), nullable=True))
        mission.create_foreign_key(op.f("fk_mission_placed_from_mission"), "mission", ["placed_from"], ["id"])
        mission.create_index(op.f("ix_mission_placed_from"), ["placed_from"])
    with op.batch_alter_table("version") as version:
        version.alter_column("mission", existing_type=sa.String(64), type_=sa.String(130), existing_nullable=True)


def downgrade() -> None:
    with op.batch_alter_table("version") as version:
        version.alter_column("mission", existing_type=sa.String(130), type_=sa.String(64), existing_nullable=True)
    with op.batch_alter_table("mission") as mission:
        mission.drop_index(op.f("ix_mission_placed_from"))
        mission.drop_constraint(op.f("fk_mission_placed_from_mission"), type_="foreignkey")
        mission.drop_column("placed_by")
        mission.drop_column("placed_from")
        mission.alter_column("key", existing_type=sa.String(130), type_=sa.String(64), existing_nullable=False)
