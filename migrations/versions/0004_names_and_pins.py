"""names and pins: what people call a version, and which one a map is to stay at"""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("version", sa.Column("name", sa.String(100), nullable=True))
    op.add_column("map", sa.Column("pinned", sa.Integer(), nullable=True))


def downgrade() -> None:
    op.drop_column("map", "pinned")
    op.drop_column("version", "name")
