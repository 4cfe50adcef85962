"""The database of the jobs before it is used: whether it answers, whose it is, and of which version.

It is one file in the data folder (SQLite), or a PostgreSQL database that was named. What is older is brought to this version when
the engine starts, in one transaction (SQLite) or step by step, each whole (PostgreSQL); what is newer, another folder's or no database
of ours is rejected in words.
"""

from __future__ import annotations

import uuid
from pathlib import Path

import sqlalchemy as sa
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, SQLAlchemyError

from ltlplan.service.job_queue.store import no_room
from verify.data import BadInput

FORMAT = 1
"""Version of what the service itself writes."""
FILE = "jobs.sqlite"
SCHEMA = "dbos"
"""Where a PostgreSQL database has the engine's tables."""
OURS = "ltlplan_service"
"""Table of what the service itself writes: whose the database is, and of which version."""
PATIENCE = 3.0
"""s that a database that others hold is waited for at the start."""


def url_of(folder: Path, database: str | None) -> str:
    """Return where the jobs are kept: the PostgreSQL database of that URL, or a file in the data folder.

    Raises:
        BadInput: It is no URL of a PostgreSQL database.
    """
    if database is None:
        return f"sqlite:///{folder.resolve() / FILE}"
    try:
        url = sa.make_url(database)
    except (ArgumentError, ValueError):  # the latter of a port that is no number
        raise BadInput("The database is no URL; one is written postgresql://USER:PASSWORD@HOST:5432/NAME.") from None
    if url.get_backend_name() not in ("postgresql", "postgres"):
        raise BadInput(f"The database is a PostgreSQL URL (postgresql://...) or left out, not {url.get_backend_name()}.")
    return url.set(drivername="postgresql").render_as_string(hide_password=False)


def prepare(url: str, owner: str, *, tables: int) -> str:
    """Look at a database before the engine does, mark it as ours if it is new, and return its own name.

    Args:
        url: Of SQLite or PostgreSQL.
        owner: Names the data folder; a database belongs to one.
        tables: Version of the engine's tables, up to which it can bring older ones.

    Raises:
        BadInput: It does not answer, is of a newer version or belongs to another folder; nothing in it was changed.
    """
    engine = engine_of(url)
    sqlite = engine.dialect.name == "sqlite"
    try:
        if sqlite:
            with engine.connect() as connection:  # writers then do not wait for readers; a property of the file, for ever
                connection.exec_driver_sql("PRAGMA journal_mode=WAL")
        with engine.begin() as connection:
            if sqlite:
                connection.exec_driver_sql("BEGIN IMMEDIATE")
            _check_tables(connection, tables)
            return _claim(connection, owner)
    except DBAPIError as error:
        raise BadInput(f"{name_of(url)} cannot be used: {_reason(error)}") from None
    except SQLAlchemyError as error:
        raise BadInput(f"{name_of(url)} cannot be used: {str(error).splitlines()[0]}.") from None
    finally:
        engine.dispose()


def engine_of(url: str) -> sa.Engine:
    """Return what opens a database; its owner disposes of it.

    Args:
        url: Of SQLite or PostgreSQL.

    Raises:
        BadInput: What speaks to PostgreSQL is not installed.
    """
    where = sa.make_url(url)
    try:
        if where.get_backend_name() == "sqlite":
            return sa.create_engine(where, connect_args={"timeout": PATIENCE})
        return sa.create_engine(where.set(drivername="postgresql+psycopg"), connect_args={"connect_timeout": 5})
    except (NoSuchModuleError, ImportError):
        raise BadInput("PostgreSQL needs psycopg: `pip install 'ltlplan[postgres]'`.") from None


def why(error: BaseException) -> str | None:
    """Return what is wrong with the database in words, or None where an error is not the database's."""
    return _reason(error) if isinstance(error, DBAPIError) else None


def _check_tables(connection: sa.Connection, known: int) -> None:
    """Reject a database that a newer engine has written."""
    schema = None if connection.dialect.name == "sqlite" else SCHEMA
    if not sa.inspect(connection).has_table("dbos_migrations", schema=schema):
        return
    table = "dbos_migrations" if schema is None else f"{schema}.dbos_migrations"
    written = connection.exec_driver_sql(f"SELECT version FROM {table}").scalar() or 0
    if written > known:
        raise _newer(f"its engine's tables are of version {written}, this one knows up to {known}")


def _claim(connection: sa.Connection, owner: str) -> str:
    """Write whose the database is, of which version, and a name for it, or hold that against what is written; return the name."""
    connection.exec_driver_sql(f"CREATE TABLE IF NOT EXISTS {OURS} (name TEXT PRIMARY KEY, value TEXT NOT NULL)")
    found = {str(name): str(value) for name, value in connection.exec_driver_sql(f"SELECT name, value FROM {OURS}")}
    added = {} if found else {"format": str(FORMAT), "folder": owner}
    if "database" not in found:
        added["database"] = uuid.uuid4().hex
    found |= added
    if not found.get("format", "").isdecimal() or int(found["format"]) > FORMAT:
        raise _newer(f"it is of format {found.get('format', '')[:40]!r}, this one knows {FORMAT}")
    if found.get("folder") != owner:
        raise BadInput(
            "This database belongs to another data folder, where what its jobs have found is kept: name that folder with --data, or "
            "take a new database."
        )
    if added:
        insert = sa.text(f"INSERT INTO {OURS} (name, value) VALUES (:name, :value)")
        connection.execute(insert, [{"name": name, "value": value} for name, value in added.items()])
    return found["database"]


def _newer(what: str) -> BadInput:
    return BadInput(f"The database was written by a newer ltlplan ({what}): start that version, or take another data folder.")


def name_of(database: str) -> str:
    """Return what to call a database in a sentence, without its password."""
    url = sa.make_url(database)
    if url.get_backend_name() == "sqlite":
        return f"The database {url.database}"
    return f"The database {url.set(query={}).render_as_string(hide_password=True)}"  # options may hold a password too


def _reason(error: DBAPIError) -> str:
    text = " ".join(str(error.orig).split())
    if "locked" in text:
        return "another program holds it (database is locked); end that program, then start again."
    if "disk is full" in text:
        return "the disk is full; make room there."
    if "not a database" in text or "malformed" in text:
        return "it is damaged, or no database at all; put a copy in its place, or take another data folder."
    if "readonly" in text or "unable to open" in text:
        return f"it cannot be written ({text}); look at who owns the folder."
    return f"{text[:300].rstrip('.?!')}."


def folder_name(folder: Path) -> str:
    """Return the data folder's own name, by which a database knows it; one is drawn for a new folder.

    Raises:
        NoRoom: The disk is full.
    """
    place = folder / "folder"
    try:
        if not place.exists():
            beside = place.with_suffix(f".{uuid.uuid4().hex}")
            beside.write_text(f"{uuid.uuid4().hex}\n", encoding="ascii")
            beside.replace(place)
        return place.read_text(encoding="ascii").strip()
    except OSError as error:
        raise no_room(folder, error) from None
