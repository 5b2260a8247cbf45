"""Changes that go to the database together: in one statement on PostgreSQL, whose WITH may write, one by one on SQLite.

What a statement costs is mostly its way there and back.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import sqlalchemy as sa

from stillroom.store.database import Transaction

Statement = sa.Insert | sa.Update


@dataclass(frozen=True)
class Change:
    statement: Statement
    """Made once: making one takes as long as running it."""
    values: Mapping[str, Any]
    """Of its parameters; one of another change that has the same name has the same value."""


def given(table: sa.Table, prefix: str, *names: str) -> dict[str, sa.BindParameter[Any]]:
    """A parameter for each of these columns, called `{prefix}_{name}`: as a column itself is called, none may be."""
    return {name: sa.bindparam(f"{prefix}_{name}", type_=table.c[name].type) for name in names}


def named(prefix: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Values for what `given` made."""
    return {f"{prefix}_{name}": value for name, value in values.items()}


def apply(tx: Transaction, *changes: Change) -> None:
    """Of different tables: none sees what another does, whatever their order."""
    if tx.dialect.name == "postgresql" and changes:
        values = {name: value for change in changes for name, value in change.values.items()}
        tx.execute(_together(*(change.statement for change in changes)), values)
    else:
        for change in changes:
            tx.execute(change.statement, change.values)


@cache
def _together(*statements: Statement) -> sa.Select[Any]:
    parts = (statement.cte(f"change_{number}") for number, statement in enumerate(statements))
    return sa.select(sa.true()).add_cte(*parts)
