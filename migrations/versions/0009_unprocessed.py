"""missions that could not be processed are found by an index"""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    failed = sa.text("traceback IS NOT NULL")
    op.create_index("ix_mission_unprocessed", "mission", ["id"], sqlite_where=failed, postgresql_where=failed)


def downgrade() -> None:
    op.drop_index("ix_mission_unprocessed", "mission")
