"""languages: in which people are told"""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "language",
        sa.Column("person", sa.String(400), nullable=False),
        sa.Column("language", sa.String(8), nullable=False),
        sa.PrimaryKeyConstraint("person", name=op.f("pk_language")),
    )


def downgrade() -> None:
    op.drop_table("language")
