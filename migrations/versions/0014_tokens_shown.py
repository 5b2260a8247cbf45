"""whether an owner was shown a robot's token, which then must not outlast that owner"""

import sqlalchemy as sa
from alembic import op

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("robot", sa.Column("token_shown", sa.Boolean(), nullable=False, server_default=sa.false()))
    robot = sa.table("robot", *map(sa.column, ("token_shown", "token_made_at", "created_at")))
    op.execute(sa.update(robot).where(robot.c.token_made_at != robot.c.created_at).values(token_shown=sa.true()))


def downgrade() -> None:
    op.drop_column("robot", "token_shown")
