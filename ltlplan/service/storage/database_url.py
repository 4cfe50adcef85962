"""Sources of the database's URL and of secrets for `ltlplan serve`: every user of a machine can read command lines, so that a password does not belong there."""

from __future__ import annotations

import stat
from collections.abc import MutableMapping
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

from verify.data.errors import BadInput
from verify.data.storage.safe_reading import read_text

VARIABLE = "LTLPLAN_DB"
"""Environment variable that holds the URL."""

_MOST = 10_000
_BETTER = f"put the URL into the environment variable {VARIABLE} or a file (--db-file), or the password into libpq's passfile (~/.pgpass)"


def database_url(
    given: str | None, file: Path | None, environment: MutableMapping[str, str]
) -> tuple[str | None, tuple[str, ...]]:
    """Return the URL of the database, None for the data folder's own, and what there is to say of how it was given.

    Args:
        given: On the command line.
        file: That holds it.
        environment: Of this process; the URL is taken out, so that no process that is started from here has it.

    Raises:
        BadInput: It was given twice, or the file cannot be read or is empty.
    """
    held = environment.pop(VARIABLE, None)
    if given is not None and file is not None:
        raise BadInput("Both --db and --db-file name a database; leave one of them out.")
    if given is not None:
        shown = f"the password in --db can be read by every user of this machine, as all command lines can: {_BETTER}."
        return given, (shown,) if has_password(given) else ()
    if file is None:
        return held, ()
    url = read_text(file, most=_MOST, what="database URL").strip()
    if not url:
        raise BadInput(f"{file} is empty; it must hold one line, postgresql://USER:PASSWORD@HOST:5432/NAME.")
    open_to = file.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO)
    return url, (f"{file} can be read by others than you; make it your own: chmod 600 {file}",) if open_to else ()


def has_password(url: str) -> bool:
    """Return whether a database's URL holds a password, before its host or among its options."""
    try:
        parts = urlsplit(url)
    except ValueError:
        return False
    return bool(parts.password) or "password" in parse_qs(parts.query)


def secret_of(variable: str, file: Path | None, environment: MutableMapping[str, str]) -> str | None:
    """Return a secret from a file, or from an environment variable, which is taken out so that no process that is started from here has it.

    Args:
        variable: The environment variable.
        file: The file, if one was named.
        environment: Of this process.

    Raises:
        BadInput: The file cannot be read or is empty.
    """
    held = environment.pop(variable, None)
    if file is None:
        return held or None
    secret = read_text(file, most=_MOST, what="secret").strip()
    if not secret:
        raise BadInput(f"{file} is empty; it must hold the secret.")
    return secret
