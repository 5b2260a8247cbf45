"""What time it is: by the database's clock where several machines share it, else by this machine's."""

import time
from datetime import UTC, datetime
from typing import Any

import sqlalchemy as sa
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.functions import FunctionElement

from stillroom.store.database import Transaction
from stillroom.store.tables import UtcDateTime


def now(tx: Transaction) -> datetime:
    if tx.dialect.name != "postgresql":
        return datetime.now(UTC)
    moment: datetime = tx.execute(sa.select(sa.func.clock_timestamp())).scalar_one()
    return moment.astimezone(UTC)


class _Moment(FunctionElement[datetime]):
    type = UtcDateTime()
    inherit_cache = True


MOMENT = _Moment()
"""`now` inside of another query."""


@compiles(_Moment)
def _of_the_database(_element: _Moment, _compiler: SQLCompiler, **_more: Any) -> str:
    return "clock_timestamp()"


@compiles(_Moment, "sqlite")
def _of_this_machine(element: _Moment, compiler: SQLCompiler, **more: Any) -> str:
    now = sa.bindparam("moment", callable_=lambda: datetime.now(UTC), type_=element.type)
    return compiler.process(now, **more)


class _Seconds(FunctionElement[float]):
    type = sa.Double()
    inherit_cache = True


SECONDS = _Seconds()
"""Since 1970, inside of another query; of the statement and not of the moment, so that an index can be searched by it."""


@compiles(_Seconds)
def _of_the_statement(_element: _Seconds, _compiler: SQLCompiler, **_more: Any) -> str:
    return "CAST(EXTRACT(epoch FROM statement_timestamp()) AS DOUBLE PRECISION)"


@compiles(_Seconds, "sqlite")
def _by_this_machine(element: _Seconds, compiler: SQLCompiler, **more: Any) -> str:
    return compiler.process(sa.bindparam("seconds", callable_=time.time, type_=element.type), **more)
