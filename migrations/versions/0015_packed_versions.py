"""documents of versions, compressed; those that were written before stay as they are"""

import json
import zlib

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

AT_ONCE = 100


def upgrade() -> None:
    with op.batch_alter_table("version") as batch_op:
        batch_op.add_column(sa.Column("packed", sa.LargeBinary()))
        batch_op.alter_column("document", existing_type=sa.JSON(), nullable=True)


def downgrade() -> None:
    _unpack(op.get_bind())
    with op.batch_alter_table("version") as batch_op:
        batch_op.alter_column("document", existing_type=sa.JSON(), nullable=False)
        batch_op.drop_column("packed")


def _unpack(connection: sa.Connection) -> None:
    version = sa.table(
        "version", sa.column("map_id"), sa.column("number"), sa.column("document", sa.JSON), sa.column("packed")
    )
    query = sa.select(version.c.map_id, version.c.number, version.c.packed).where(version.c.document.is_(sa.null()))
    while rows := connection.execute(query.limit(AT_ONCE)).all():
        for row in rows:
            this = version.c.map_id == row.map_id, version.c.number == row.number
            document = json.loads(zlib.decompress(row.packed))
            connection.execute(sa.update(version).where(*this).values(document=document, packed=sa.null()))
