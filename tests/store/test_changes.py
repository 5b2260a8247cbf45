"""Changes that go to the database together."""

import sqlalchemy as sa

from stillroom.store.changes import Change, apply, given, named
from stillroom.store.database import Database
from stillroom.store.tables import language, preference
from tests.service.test_statements import asked

_SPEAK = sa.insert(language).values(given(language, "said", "person", "language"))
_PREFER = (
    sa.update(preference).where(preference.c.person == sa.bindparam("of")).values(given(preference, "chosen", "kinds"))
)


def test_changes_of_several_tables_are_all_made_and_ask_postgresql_once(database: Database) -> None:
    with database.write() as tx:
        for person in ("ann", "bob"):
            tx.execute(sa.insert(preference).values(person=person, channel="email", kinds=[]))
    with database.write() as tx, asked() as statements:
        apply(
            tx,
            Change(_SPEAK, named("said", {"person": "ann", "language": "de"})),
            Change(_PREFER, {"of": "ann"} | named("chosen", {"kinds": ["door"]})),
        )
    assert len(statements) == (1 if database.is_postgresql else 2)
    with database.read() as tx:
        assert tx.execute(sa.select(language.c.person, language.c.language)).all() == [("ann", "de")]
        chosen = tx.execute(sa.select(preference.c.person, preference.c.kinds).order_by(preference.c.person)).all()
    assert chosen == [("ann", ["door"]), ("bob", [])]


def test_no_change_asks_nothing(database: Database) -> None:
    with database.write() as tx, asked() as statements:
        apply(tx)
    assert not statements
