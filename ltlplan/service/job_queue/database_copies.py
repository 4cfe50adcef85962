"""Copies of the jobs' database: out of PostgreSQL into a file of SQLite, as it is at one instant, and back into PostgreSQL.

A backup has the jobs as a file of SQLite wherever they were, so that it is restored into either. The engine makes the tables of the target; both have the
same tables of its version, and of each the columns that both have are copied.
"""

from __future__ import annotations

import json
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import sqlalchemy as sa
from sqlalchemy.exc import SQLAlchemyError

from ltlplan.service.job_queue.database import OURS, SCHEMA, engine_of, name_of, why
from verify.data import BadInput

_AT_ONCE = 500
"""Rows that are held at the same time."""
_JOBS = "workflow_status"
_VERSION = "dbos_migrations"


def save_jobs(database: str, folder: str, target: Path) -> int:
    """Copy the jobs out of PostgreSQL, while its service runs, and return how many they are.

    Args:
        database: Its URL.
        folder: The data folder's own name, whose jobs they have to be.
        target: File of SQLite to make.

    Raises:
        BadInput: It cannot be read, is of another version, or has another folder's jobs.
    """
    from ltlplan.service.job_queue.engine import make_tables

    url = f"sqlite:///{target}"
    make_tables(url)
    with _opened(database) as source, _opened(url) as copy, source.connect() as reading, copy.begin() as writing:
        reading.execution_options(isolation_level="REPEATABLE READ")
        with reading.begin():
            reading.exec_driver_sql("SET TRANSACTION READ ONLY")
            _require_ours(reading, folder, database)
            return _copied(reading, writing)


def load_jobs(source: Path, database: str) -> None:
    """Copy the jobs of a file of SQLite into a PostgreSQL database that has none, all or none.

    Args:
        source: The file.
        database: URL of the database.

    Raises:
        BadInput: It cannot be written, or has jobs already.
    """
    from ltlplan.service.job_queue.engine import make_tables

    url = f"sqlite:///{source}"
    make_tables(url)  # an earlier version's
    with _opened(database) as target, _opened(url) as copy, copy.connect() as reading:
        with target.connect() as looking:
            _require_empty(looking, database)
        make_tables(database)
        with target.begin() as writing:
            _require_empty(writing, database)
            _copied(reading, writing)


def _copied(reading: sa.Connection, writing: sa.Connection) -> int:
    """Copy all rows of all tables, and return how many jobs they are."""
    given, wanted = _tables(reading), _tables(writing)
    if OURS not in wanted:
        wanted[OURS] = given[OURS].to_metadata(sa.MetaData())
        wanted[OURS].create(writing)
    jobs = 0
    for name in sorted(
        wanted.keys() & given.keys() - {_VERSION}, key=lambda name: (name != _JOBS, name)
    ):  # others refer to jobs
        columns = [column.name for column in wanted[name].columns if column.name in given[name].columns]
        rows = reading.execution_options(yield_per=_AT_ONCE).execute(sa.select(*(given[name].c[each] for each in columns)))
        for part in rows.mappings().partitions(_AT_ONCE):
            made = [{each: _fitting(row[each], wanted[name].c[each]) for each in columns} for row in part]
            writing.execute(wanted[name].insert(), made)
            jobs += len(made) if name == _JOBS else 0
    return jobs


def _tables(connection: sa.Connection) -> dict[str, sa.Table]:
    """Return the engine's tables and our own, by their names."""
    own = sa.MetaData()
    own.reflect(connection, only=lambda name, _: name == OURS or connection.dialect.name == "sqlite")
    if connection.dialect.name != "sqlite":
        own.reflect(connection, schema=SCHEMA)
    return {table.name: table for table in own.tables.values()}


def _fitting(value: Any, column: sa.Column[Any]) -> Any:  # of any type: what a database holds
    """Return a value as a column of the other database holds it."""
    if isinstance(column.type, sa.Boolean):
        return None if value is None else bool(value)
    if isinstance(column.type, sa.JSON):
        return json.loads(value) if isinstance(value, str) else value
    if isinstance(value, dict | list):
        return json.dumps(value)
    return int(value) if isinstance(value, bool) else value


def _require_ours(connection: sa.Connection, folder: str, database: str) -> None:
    from ltlplan.service.job_queue.engine import tables

    known = _tables(connection)
    if OURS not in known or _VERSION not in known:
        raise BadInput(f"{name_of(database)} has no jobs of a service.")
    facts = {str(name): str(value) for name, value in connection.execute(sa.select(known[OURS]))}
    if facts.get("folder") != folder:
        raise BadInput(f"{name_of(database)} belongs to another data folder; name that one with --data.")
    written = connection.execute(sa.select(known[_VERSION].c.version)).scalar()
    if written != tables(sqlite=False):
        raise BadInput(f"{name_of(database)} was written by another version of ltlplan: back it up with that one.")


def _require_empty(connection: sa.Connection, database: str) -> None:
    known = _tables(connection)
    taken = [name for name in (OURS, _JOBS) if name in known and connection.execute(sa.select(known[name]).limit(1)).first()]
    if taken:
        raise BadInput(f"{name_of(database)} has jobs already; name an empty one.")


@contextmanager
def _opened(url: str) -> Generator[sa.Engine]:
    """Have a database while something is done, and say in words what is wrong with it."""
    engine = engine_of(url)
    try:
        yield engine
    except SQLAlchemyError as error:
        raise BadInput(f"{name_of(url)} cannot be used: {why(error) or str(error).splitlines()[0]}") from None
    finally:
        engine.dispose()
