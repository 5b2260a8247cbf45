"""messages: who wants to be told what, and what is on its way to them"""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

BIG_ID = sa.BigInteger().with_variant(sa.Integer(), "sqlite")
MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.add_column("conflict", sa.Column("quiet", sa.Boolean(), server_default=sa.false(), nullable=False))
    op.create_table(
        "preference",
        sa.Column("person", sa.String(400), nullable=False),
        sa.Column("channel", sa.String(8), nullable=False),
        sa.Column("kinds", sa.JSON(), nullable=False),
        sa.PrimaryKeyConstraint("person", "channel", name=op.f("pk_preference")),
    )
    op.create_table(
        "receiver",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("key", sa.String(40), nullable=False),
        sa.Column("channel", sa.String(8), nullable=False),
        sa.Column("person", sa.String(400), nullable=False),
        sa.Column("fleet", sa.Boolean(), nullable=False),
        sa.Column("address", sa.Text(), nullable=False),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("label", sa.String(200), nullable=False),
        sa.Column("kinds", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("keys", sa.JSON(), nullable=False),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("confirmed_at", MOMENT, nullable=True),
        sa.Column("delivered_at", MOMENT, nullable=True),
        sa.Column("failures", sa.Integer(), nullable=False),
        sa.Column("failing_since", MOMENT, nullable=True),
        sa.Column("resume_at", MOMENT, nullable=True),
        sa.Column("ended_at", MOMENT, nullable=True),
        sa.Column("ended_reason", sa.Text(), nullable=True),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_receiver")),
        sa.UniqueConstraint("key", name=op.f("uq_receiver_key")),
    )
    op.create_index(op.f("ix_receiver_person"), "receiver", ["person"])
    for name, column in (("email", "person"), ("push", "digest")):
        only = sa.text(f"channel = '{name}'")
        op.create_index(
            f"ix_receiver_{name}", "receiver", [column], unique=True, sqlite_where=only, postgresql_where=only
        )
    op.create_table(
        "outbox",
        sa.Column("event_id", BIG_ID, autoincrement=False, nullable=False),
        sa.ForeignKeyConstraint(["event_id"], ["event.id"], name=op.f("fk_outbox_event_id_event")),
        sa.PrimaryKeyConstraint("event_id", name=op.f("pk_outbox")),
    )
    op.create_table(
        "delivery",
        sa.Column("id", BIG_ID, nullable=False),
        sa.Column("key", sa.String(40), nullable=False),
        sa.Column("receiver_id", BIG_ID, nullable=False),
        sa.Column("kind", sa.String(32), nullable=False),
        sa.Column("content", sa.JSON(), nullable=False),
        sa.Column("state", sa.String(12), nullable=False),
        sa.Column("attempts", sa.Integer(), nullable=False),
        sa.Column("due_at", MOMENT, nullable=False),
        sa.Column("claim", sa.String(32), nullable=True),
        sa.Column("created_at", MOMENT, nullable=False),
        sa.Column("tried_at", MOMENT, nullable=True),
        sa.Column("finished_at", MOMENT, nullable=True),
        sa.Column("status_code", sa.Integer(), nullable=True),
        sa.Column("reason", sa.Text(), nullable=True),
        sa.ForeignKeyConstraint(["receiver_id"], ["receiver.id"], name=op.f("fk_delivery_receiver_id_receiver")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_delivery")),
    )
    underway = sa.text("state = 'waiting'")
    op.create_index("ix_delivery_due_at", "delivery", ["due_at"], sqlite_where=underway, postgresql_where=underway)
    op.create_index("ix_delivery_receiver_id_id", "delivery", ["receiver_id", "id"])
    op.create_index("ix_delivery_finished_at", "delivery", ["finished_at"])
    op.create_table(
        "service_key",
        sa.Column("name", sa.String(32), nullable=False),
        sa.Column("value", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_service_key")),
    )


def downgrade() -> None:
    op.drop_table("service_key")
    op.drop_table("delivery")
    op.drop_table("outbox")
    op.drop_table("receiver")
    op.drop_table("preference")
    op.drop_column("conflict", "quiet")
