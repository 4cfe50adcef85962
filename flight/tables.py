"""Flight logs as files: CSV and Parquet, written and read back, and MCAP for viewers.

A Parquet file keeps what a CSV cannot: the mission's name, margin, verdicts, seed and the certificate's digest.
"""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flight.log import COLUMNS, MEASURED_COLUMNS, ROTOR_COLUMNS, Event, FlightLog
from verify.data import BadInput, Letter, MissingEngine
from verify.data.single_files import write_single

MAX_BYTES = 500_000_000
MAX_ROBOTS = 1000

_NUMBERS = tuple(name for name in COLUMNS if name not in ("robot", "letter"))
_KEPT = ("mission", "margin", "satisfied", "tube", "seed", "certificate", "notes", "peak", "events")


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
        from flight.mcap_recording import mcap_bytes

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
    try:
        if path.stat().st_size > MAX_BYTES:
            raise BadInput(f"{path} is larger than {MAX_BYTES // 1_000_000} MB; that is no flight log.")
        data = path.read_bytes()
    except OSError as error:
        raise BadInput(f"{path} cannot be read: {error.strerror or error}.") from None
    if path.suffix == ".parquet":
        return _from_parquet(data, str(path))
    try:
        return log_from_csv(data.decode("utf-8-sig"), str(path))
    except UnicodeDecodeError as error:
        raise BadInput(f"{path} is not UTF-8 text (byte {error.start}).") from None


def log_from_csv(text: str, source: str = "log") -> FlightLog:
    """Read a log from the text of flight.csv; `source` names it in messages."""
    try:
        header, *rows = [row for row in csv.reader(io.StringIO(text)) if row] or [[]]
    except csv.Error as error:
        raise BadInput(f"{source} is no CSV: {error}.") from None
    missing = [name for name in COLUMNS if name not in header]
    if missing:
        raise BadInput(
            f"{source} is no flight log: it lacks the columns {', '.join(missing)}. "
            "Recordings with other columns are read by `flight.read_recording`."
        )
    short = next((i for i, row in enumerate(rows) if len(row) != len(header)), None)
    if short is not None:
        raise BadInput(f"{source}:{short + 2}: {len(rows[short])} cells under {len(header)} columns.")
    columns = {name: [row[i] for row in rows] for i, name in enumerate(header)}
    return _assembled({name: columns[name] for name in header}, {}, source)


def _assembled(columns: Mapping[str, Sequence[Any]], kept: Mapping[str, Any], source: str) -> FlightLog:
    """Put a log together from columns, one row a sample and robot."""
    names = [str(name) for name in columns["robot"]]
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

    letters: list[Letter] = [frozenset(str(text).split()) for text in columns["letter"]]
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
        **{"mission": "", **kept},
    )


def require_forward(times: Any, source: str) -> None:
    """Refuse times that stand still or go back.

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
        try:
            number = math.nan if blank and value in ("", None) else float(value)
        except (TypeError, ValueError):
            raise BadInput(f"{source}:{index + 2}: {name} is {value!r}; it must be a number.") from None
        if not math.isfinite(number) and not (blank and math.isnan(number)):
            raise BadInput(f"{source}:{index + 2}: {name} is {value}; it must be finite.")
        result[index] = number
    return result


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
    kept = {name: getattr(log, name) for name in _KEPT}
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
        table = parquet.read_table(io.BytesIO(data))
        kept = json.loads((table.schema.metadata or {}).get(b"ltlplan", b"{}"))
        kept = {name: value for name, value in kept.items() if name in _KEPT}
        kept["events"] = tuple(Event(**event) for event in kept.get("events", ()))
        kept["notes"] = tuple(kept.get("notes", ()))
        kept["peak"] = None if kept.get("peak") is None else np.array(kept["peak"], dtype=np.float64)
    except (arrow.ArrowException, ValueError, TypeError, AttributeError) as error:
        raise BadInput(f"{source} is no flight log in Parquet: {str(error).splitlines()[0]}.") from None
    columns = {name: table.column(name).to_pylist() for name in table.column_names}
    missing = [name for name in COLUMNS if name not in columns]
    if missing:
        raise BadInput(f"{source} is no flight log: it lacks the columns {', '.join(missing)}.")
    return _assembled(columns, kept, source)


def _pyarrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError:
        raise MissingEngine("Parquet needs pyarrow: pip install 'ltlplan[parquet]'.") from None
    return pyarrow, parquet
