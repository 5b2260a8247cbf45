"""The tables of what is deleted, and of who looked."""

import sqlalchemy as sa

from stillroom.store.tables import BigId, UtcDateTime, metadata

discarded_grid = sa.Table(
    "discarded_grid",  # grids that perhaps nothing refers to any more, and that are then deleted
    metadata,
    sa.Column("key", sa.String(64), primary_key=True),
    sa.Column("at", UtcDateTime, nullable=False),
)

grid_sweep = sa.Table(
    "grid_sweep",  # at most one row
    metadata,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("times", sa.BigInteger, nullable=False),  # that discarded grids were deleted
)

access_log = sa.Table(
    "access_log",  # what people did with a robot's maps; the same by the same within an hour is one row
    metadata,
    sa.Column("id", BigId, primary_key=True),
    sa.Column("robot_id", sa.ForeignKey("robot.id"), nullable=False),
    sa.Column("hour", sa.BigInteger, nullable=False),  # since 1970
    sa.Column("who", sa.String(400), nullable=False),
    sa.Column("did", sa.String(16), nullable=False),
    sa.Column("what", sa.String(200), nullable=False),
    sa.Column("source", sa.String(64), nullable=False),  # network
    sa.Column("times", sa.Integer, nullable=False),
    sa.Column("last_at", UtcDateTime, nullable=False),
    sa.UniqueConstraint("robot_id", "hour", "who", "did", "what", "source"),
)

retention = sa.Table(
    "retention",  # how long a home keeps what its robots sensed; without a row, as long as the home
    metadata,
    sa.Column("home", sa.String(320), primary_key=True),  # whose it is; "": robots that are nobody's
    sa.Column("days", sa.Integer, nullable=False),
    sa.Column("changed_by", sa.String(400), nullable=False),
    sa.Column("changed_at", UtcDateTime, nullable=False),
)
