"""Flight logs as files: CSV and Parquet, written and read back, and MCAP for viewers.

A Parquet file keeps what a CSV cannot: the mission's name, margin, verdicts, seed and the certificate's digest.
"""

from __future__ import annotations

import dataclasses
import io
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flight.logs.log import MEASURED_COLUMNS, ROTOR_COLUMNS, Event, FlightLog
from flight.model.attitude import Floats
from flight.storage.single_files import write_single
from verify.data import BadInput, Letter, MissingEngine
from verify.data.storage.safe_reading import decoded, parse_json, read_bytes
from verify.data.storage.tables import MAX_BYTES, MAX_ROWS, decimal, read_table
from verify.recordings.flight_log import LOG_COLUMNS

MAX_ROBOTS = 1000

_OURS = (*LOG_COLUMNS, *ROTOR_COLUMNS, *MEASURED_COLUMNS)
_NUMBERS = tuple(name for name in LOG_COLUMNS if name not in ("robot", "letter"))


def write_log(log: FlightLog, path: str | os.PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a log as `.csv`, `.parquet` or `.mcap`, by the name's ending.

    Args:
        log: The log.
        path: Where to.
        overwrite: Whether a file that is there already, with other contents, may be replaced.

    Raises:
        BadInput: Another ending, there is another file of that name, or it cannot be written.
        MissingEngine: Parquet without pyarrow, or MCAP without mcap.
    """
    path = Path(path)
    if path.suffix == ".csv":
        content = log.to_csv().encode()
    elif path.suffix == ".parquet":
        content = _parquet(log)
    elif path.suffix == ".mcap":
        from flight.logs.mcap_file import mcap_bytes

        content = mcap_bytes(log)
    else:
        raise BadInput(f"{path.name}: a log is written as .csv, .parquet or .mcap.")
    write_single(path, content, overwrite=overwrite)
    return path


def read_log(path: str | os.PathLike[str]) -> FlightLog:
    """Read a log that `write_log` or `FlightLog.to_csv` wrote.

    Raises:
        BadInput: It is no such log, lacks a robot at some time, or its times do not go forward.
        MissingEngine: Parquet without pyarrow.
    """
    path = Path(path)
    data = read_bytes(path, most=MAX_BYTES, what="flight log")
    if path.suffix == ".parquet":
        return _from_parquet(data, str(path))
    return log_from_csv(decoded(data, str(path), "flight log"), str(path))


def log_from_csv(text: str, source: str = "log") -> FlightLog:
    """Read a log from the text of flight.csv; `source` names it in messages.

    Raises:
        BadInput: The text is no flight log, or one that does not hold together.
    """

    def require_ours(header: tuple[str, ...]) -> None:
        missing = [name for name in LOG_COLUMNS if name not in header]
        if missing:
            raise BadInput(
                f"{source} is no flight log: it lacks the columns {', '.join(missing)}. "
                "Recordings with other columns are read by `flight.read_recording`."
            )

    table = read_table(text, source, check=require_ours)
    if not table.header:
        raise BadInput(f"{source} is empty; that is no flight log.")
    places = {name: table.column(name) for name in table.header if name in _OURS}
    log = _assembled({name: [row[place] for row in table.rows] for name, place in places.items()}, {}, source)
    for name, place in places.items():
        if name not in ("robot", "letter"):
            table.require_whole(place)
    return log


def _assembled(columns: Mapping[str, Sequence[Any]], kept: Mapping[str, Any], source: str) -> FlightLog:
    """Put a log together from columns, one row a sample and robot."""
    for group in (ROTOR_COLUMNS, MEASURED_COLUMNS):
        if (there := [name in columns for name in group]) != [there[0]] * len(group):
            raise BadInput(f"{source} has some of the columns {', '.join(group)}, but not all of them.")
    for name in ("robot", "letter"):
        if not all(isinstance(text, str) for text in columns[name]):
            raise BadInput(f"{source}: every {name} must be a text.")
    names = list(columns["robot"])
    robots = tuple(dict.fromkeys(names))
    if not names:
        raise BadInput(f"{source} has no rows.")
    if len(robots) > MAX_ROBOTS:
        raise BadInput(f"{source} has {len(robots)} robots; at most {MAX_ROBOTS} are read.")
    numbers = {name: _floats(columns[name], name, source, blank=False) for name in _NUMBERS}
    times = numbers["t"][:: len(robots)]
    for index, (name, time) in enumerate(zip(names, numbers["t"].tolist(), strict=True)):
        if name != robots[index % len(robots)] or time != times[index // len(robots)]:
            wanted, at = robots[index % len(robots)], times[min(index // len(robots), len(times) - 1)]
            raise BadInput(
                f"{source} has a gap: no row for '{wanted}' at {at:g} s (row {index + 2} is '{name}' at {time:g} s)."
            )
    if len(names) % len(robots):
        raise BadInput(f"{source} has a gap: the last time, {times[-1]:g} s, lacks '{robots[len(names) % len(robots)]}'.")
    require_forward(times, source)

    def block(parts: Sequence[str], *, blank: bool = False) -> Any:
        values = [_floats(columns[part], part, source, blank=blank) if part not in numbers else numbers[part] for part in parts]
        return np.stack(values, axis=-1).reshape(len(times), len(robots), len(parts))

    if kept.get("peak") is not None and len(kept["peak"]) != len(robots):
        raise BadInput(f"{source} keeps {len(kept['peak'])} largest errors of {len(robots)} robots.")
    letters: list[Letter] = [frozenset(text.split()) for text in columns["letter"]]
    said: dict[str, Any] = {"mission": "", **kept}
    return FlightLog(
        robots=robots,
        times=times,
        position=block(("x", "y", "z")),
        velocity=block(("vx", "vy", "vz")),
        attitude=block(("roll", "pitch", "yaw")),
        thrust=block(("thrust",))[..., 0],
        rates=block(("wx", "wy", "wz")),
        error=block(("error",))[..., 0],
        letters=tuple(tuple(letters[i : i + len(robots)]) for i in range(0, len(letters), len(robots))),
        rotors=block(ROTOR_COLUMNS) if ROTOR_COLUMNS[0] in columns else None,
        measured=block(MEASURED_COLUMNS, blank=True) if MEASURED_COLUMNS[0] in columns else None,
        **said,
    )


def require_forward(times: Floats, source: str) -> None:
    """Reject times that stand still or go back.

    Raises:
        BadInput: As said, with the place.
    """
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        i = int(back[0])
        raise BadInput(f"{source}: times must go forward, but {times[i + 1]:g} s follows {times[i]:g} s (sample {i + 1}).")


def _floats(values: Sequence[Any], name: str, source: str, *, blank: bool) -> Any:
    result = np.empty(len(values))
    for index, value in enumerate(values):
        if blank and (value is None or value == "" or value != value):
            result[index] = math.nan
            continue
        if isinstance(value, str):
            number = decimal(value)
            value = value if number is None else number.float()
        if isinstance(value, str | bool) or not isinstance(value, int | float):
            kind = "finite" if isinstance(value, str) and value.strip("+-").lower() in _NOT_FINITE else "a number"
            raise BadInput(f"{source}:{index + 2}: {name} is {value!r:.40}; it must be {kind}.")
        if not -_MOST <= value <= _MOST:
            raise BadInput(f"{source}:{index + 2}: {name} is {value!s:.40}; it must be finite.")
        result[index] = value
    return result


_NOT_FINITE = ("nan", "inf", "infinity")
_MOST = 1e100


def _parquet(log: FlightLog) -> bytes:
    arrow, parquet = _pyarrow()
    robots = len(log.robots)
    columns: dict[str, Any] = {"t": np.repeat(log.times, robots), "robot": list(log.robots) * len(log)}
    blocks = {
        "x y z": log.position, "vx vy vz": log.velocity, "roll pitch yaw": log.attitude, "thrust": log.thrust[..., None],
        "wx wy wz": log.rates, "error": log.error[..., None],
    }  # fmt: skip
    extra = {" ".join(ROTOR_COLUMNS): log.rotors, " ".join(MEASURED_COLUMNS): log.measured}
    for names, values in blocks.items():
        columns.update(_split(names, values))
    columns["letter"] = [" ".join(sorted(letter)) for row in log.letters for letter in row]
    for names, values in extra.items():
        if values is not None:
            columns.update(_split(names, values))
    kept = {name: getattr(log, name) for name in _KINDS}
    kept["peak"] = None if log.peak is None else log.peak.tolist()
    kept["events"] = [dataclasses.asdict(event) for event in log.events]
    table = arrow.table(columns).replace_schema_metadata({"ltlplan": json.dumps(kept)})
    sink = io.BytesIO()
    parquet.write_table(table, sink)
    return sink.getvalue()


def _split(names: str, values: Any) -> dict[str, Any]:
    parts = names.split()
    return {part: values[..., i].ravel() for i, part in enumerate(parts)}


def _from_parquet(data: bytes, source: str) -> FlightLog:
    arrow, parquet = _pyarrow()
    try:
        file = parquet.ParquetFile(io.BytesIO(data))
        names = file.schema_arrow.names
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise BadInput(f"{source} has {names.count(twice[0])} columns '{twice[0]}'; one is needed.")
        read = [name for name in _OURS if name in names]
        size = sum(file.metadata.row_group(i).total_byte_size for i in range(file.metadata.num_row_groups))
        if file.metadata.num_rows > MAX_ROWS or size > MAX_BYTES:
            raise BadInput(f"{source} holds more than {MAX_ROWS} rows or {MAX_BYTES // 1_000_000} MB; that is no flight log.")
        table = file.read(columns=read)
        kept = _kept(parse_json((table.schema.metadata or {}).get(b"ltlplan", b"{}"), source), source)
    except (arrow.ArrowException, ValueError, TypeError, OSError) as error:
        raise BadInput(f"{source} is no flight log in Parquet: {str(error).splitlines()[0]}.") from None
    columns = {name: table.column(name).to_pylist() for name in table.column_names}
    missing = [name for name in LOG_COLUMNS if name not in columns]
    if missing:
        raise BadInput(f"{source} is no flight log: it lacks the columns {', '.join(missing)}.")
    return _assembled(columns, kept, source)


def _kept(value: Any, source: str) -> dict[str, Any]:
    """Return what a Parquet file keeps beside its columns, each of the type that a log has it in."""
    if not isinstance(value, dict) or not all(_KINDS[name](item) for name, item in value.items() if name in _KINDS):
        raise BadInput(f"{source} is no flight log in Parquet: what it says of the flight beside its columns has another form.")
    kept = {name: item for name, item in value.items() if name in _KINDS}
    kept["events"] = tuple(Event(**event) for event in kept.get("events", ()))
    kept["notes"] = tuple(kept.get("notes", ()))
    kept["controllers"] = None if kept.get("controllers") is None else tuple(kept["controllers"])
    kept["peak"] = None if kept.get("peak") is None else np.array(kept["peak"], dtype=np.float64)
    return kept


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _MOST


def _is_event(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and set(value) == {"time", "robot", "kind", "sentence"}
        and _is_number(value["time"])
        and isinstance(value["robot"], str | None)
        and isinstance(value["kind"], str)
        and isinstance(value["sentence"], str)
    )


_KINDS: dict[str, Callable[[Any], bool]] = {
    "mission": lambda value: isinstance(value, str),
    "margin": lambda value: value is None or _is_number(value),
    "satisfied": lambda value: isinstance(value, bool | None),
    "tube": lambda value: isinstance(value, str | None),
    "seed": lambda value: value is None or (isinstance(value, int) and not isinstance(value, bool)),
    "certificate": lambda value: isinstance(value, str | None),
    "controllers": lambda value: value is None or (isinstance(value, list) and all(isinstance(name, str) for name in value)),
    "notes": lambda value: isinstance(value, list) and all(isinstance(note, str) for note in value),
    "peak": lambda value: value is None or (isinstance(value, list) and all(map(_is_number, value))),
    "events": lambda value: isinstance(value, list) and all(map(_is_event, value)),
}
"""What a Parquet file keeps beside its columns, and what each may be."""


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingEngine("Parquet needs pyarrow: pip install 'ltlplan[parquet]'.") from None
    return pyarrow, parquet
