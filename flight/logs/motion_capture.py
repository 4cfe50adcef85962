"""Tables as motion capture exports them: Vicon, OptiTrack Motive and Qualisys, made plain tables of ours.

They put bodies over columns in lines of their own, and say units beside. Here each column of a body's position gets the name that
plain tables have (`quad0.x (mm)`); all others (rotations, markers, residuals) keep names that mean nothing.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from flight.logs.import_options import SAME, Axes
from verify.data import BadInput
from verify.data.errors import did_you_mean
from verify.data.storage.tables import MAX_LINE, MAX_ROWS, Table, decimal

_UNITS = {"m": "m", "meters": "m", "cm": "cm", "centimeters": "cm", "mm": "mm", "millimeters": "mm"}
_BODIES, _NO_BODIES = ("Objects", "Segments"), ("Trajectories", "Model Outputs", "Devices")
"""Titles of the parts of Vicon's exports."""
_NOTHING = "-"
"""Name of columns that hold no position."""


@dataclass(frozen=True, slots=True)
class Exported:
    """An export, made a plain table.

    Attributes:
        table: Columns `t` and `BODY.x (UNIT)`, and others that mean nothing.
        axes: What the format says of its axes; None where nobody knows which of them points up.
        notes: How it was read, in sentences.
        promised: From when to when it says that it goes, s on the table's clock; None where it says nothing beyond its rows.
    """

    table: Table
    axes: Axes | None
    notes: tuple[str, ...]
    promised: tuple[Fraction, Fraction] | None = None


def export_table(text: str, source: str, robots: Sequence[str]) -> Exported | None:
    """Make a plain table of what motion capture exported; None where the text is of none of its formats.

    Args:
        text: The file's text.
        source: Names it in messages.
        robots: Bodies that are looked for, as the export calls them.

    Raises:
        BadInput: It is such an export, but not of bodies' positions over time, or a body is missing.
    """
    first = text[:200].lstrip()
    if first.startswith("Format Version,"):
        return _motive(_rows(text, source, ","), source, robots, whole=text.endswith(("\n", "\r")))
    if first.startswith(("NO_OF_FRAMES\t", "FILE_VERSION\t")):
        return _qualisys(_rows(text, source, "\t"), source, robots, whole=text.endswith(("\n", "\r")))
    head = first.splitlines()[0].strip().rstrip(",") if first else ""
    if head in _BODIES:
        return _vicon(_rows(text, source, ","), source, robots, whole=text.endswith(("\n", "\r")))
    if head in _NO_BODIES:
        raise BadInput(f"{source} is an export of {head.lower()}; export the objects (rigid bodies) instead.")
    return None


_Rows = list[tuple[int, list[str]]]
"""Lines that hold anything: their number and cells."""


def _rows(text: str, source: str, delimiter: str) -> _Rows:
    """Return all lines, blank ones as no cells."""
    rows: _Rows = []
    try:
        for row in csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=delimiter == ","):
            if len(rows) == MAX_ROWS or (row and len(row[0]) > MAX_LINE):
                raise BadInput(f"{source} has more than {MAX_ROWS} rows, or a cell that is no number; cut the recording.")
            rows.append((len(rows) + 1, [cell.strip() for cell in row]))
    except csv.Error as error:
        raise BadInput(f"{source} is no table: {error}.") from None
    return rows


def _motive(rows: _Rows, source: str, robots: Sequence[str], *, whole: bool) -> Exported:
    """Read OptiTrack Motive's export: settings, then lines for type, name and kind of each column."""
    cells = rows[0][1]
    about = dict(zip(cells[::2], cells[1::2], strict=False))
    unit, space = _UNITS.get(about.get("Length Units", "").lower()), about.get("Coordinate Space", "")
    if unit is None:
        raise BadInput(
            f"{source} says its Length Units are {about.get('Length Units', '')!r:.40}; Meters, Centimeters or Millimeters are read."
        )
    if space != "Global":
        raise BadInput(f"{source} says its Coordinate Space is {space!r:.40}; export global coordinates.")
    at = next(
        (k for k, (_, row) in enumerate(rows) if row[:1] == ["Frame"] and len(row) > 1 and row[1].startswith("Time")), None
    )
    if at is None or at < 3:
        raise BadInput(f"{source} has no line 'Frame,Time (Seconds),...': export it with its header and times.")
    labelled = {row[1]: row for _, row in rows[1:at] if len(row) > 1 and row[1] in ("Type", "Name")}
    kinds = rows[at - 1][1]
    if set(labelled) != {"Type", "Name"} or "Position" not in kinds:
        raise BadInput(f"{source} does not say which columns are whose position: export rigid bodies with the whole header.")
    header = list(rows[at][1])
    names, types = labelled["Name"], labelled["Type"]
    found = ["t", *[_NOTHING] * (len(header) - 1)]
    found[0], found[1] = _NOTHING, "t"
    bodies: list[str] = []
    for k in range(2, len(header)):
        if k < min(len(names), len(types), len(kinds)) and types[k] == "Rigid Body" and kinds[k] == "Position":
            bodies.append(names[k])
            found[k] = f"{names[k]}.{header[k].lower()} ({unit})"
    _require_bodies(bodies, robots, source)
    said = f"Motive's export: lengths in {unit}, times in s since its first frame."
    wanted, rate = about.get("Total Exported Frames", ""), about.get("Export Frame Rate", "")
    promised, lacks = _promised(rows[at + 1 :], wanted, rate, 0, source)
    return Exported(_table(rows[at + 1 :], found, source, whole=whole), None, (said, *lacks), promised)


def _vicon(rows: _Rows, source: str, robots: Sequence[str], *, whole: bool) -> Exported:
    """Read Vicon's export: the rate, names over the columns of each object, axes, units, then frames."""
    rate = decimal(rows[1][1][0]) if len(rows) > 1 and rows[1][1] else None
    header = rows[3][1] if len(rows) > 4 else []
    if rate is None or rate.whole <= 0 or header[:2] != ["Frame", "Sub Frame"]:
        raise BadInput(f"{source} begins as Vicon's export does, but has no rate on line 2 or no 'Frame,Sub Frame' on line 4.")
    over, units = rows[2][1], rows[4][1]
    found, bodies, name = ["t", _NOTHING, *[_NOTHING] * (len(header) - 2)], list[str](), ""
    for k in range(2, len(header)):
        name = _object(over[k]) if k < len(over) and over[k] else name
        if header[k] in ("TX", "TY", "TZ"):
            unit = _UNITS.get(units[k].lower() if k < len(units) else "")
            if unit is None or not name:
                raise BadInput(f"{source}: column {k + 1} ({header[k]}) has no object's name or no unit of length over it.")
            bodies.append(name)
            found[k] = f"{name}.{header[k][1].lower()} ({unit})"
    _require_bodies(bodies, robots, source)
    end = next((k for k in range(5, len(rows)) if _is_title(rows[k][1])), len(rows))
    stamped: _Rows = []
    for line, row in rows[5:end]:
        if not any(row):
            continue  # a frame that was not written
        if len(row) < 2 or decimal(row[0]) is None or row[1] not in ("0", ""):
            raise BadInput(
                f"{source}:{line}: a row of Vicon's export begins with its frame and sub frame 0, not {','.join(row[:2])!r:.40}."
            )
        stamped.append((line, [_seconds(row[0], rate.exact()), *row[1:]]))
    said = f"Vicon's export: times are frame numbers / {float(rate.exact()):g} Hz."
    frames = [number / rate.exact() for number in _frames(rows)]
    promised = (min(frames), max(frames)) if frames else None
    return Exported(_table(stamped, found, source, whole=whole or end < len(rows)), SAME, (said,), promised)


def _is_title(row: list[str]) -> bool:
    """Tell the first line of a part of Vicon's export."""
    return bool(row) and row[0] in (*_BODIES, *_NO_BODIES, "Events", "Joints") and not any(row[1:])


def _frames(rows: _Rows) -> list[Fraction]:
    """Return frames of all parts of Vicon's export, which are counted by its cameras whatever they hold.

    Lines without a number before a part's first frame, or after its last one, are frames too: all but one empty line, which ends a part.
    """
    found: list[Fraction] = []
    begins = [k + 2 for k, (_, row) in enumerate(rows) if row[:2] == ["Frame", "Sub Frame"]]
    for begin in begins:
        end = next((k for k in range(begin, len(rows)) if _is_title(rows[k][1])), len(rows))
        part = [row for _, row in rows[begin:end]]
        if part and not part[-1]:
            part.pop()
        known = [(k, number.exact()) for k, row in enumerate(part) if row and (number := decimal(row[0])) is not None]
        if known:
            (first, least), (last, most) = known[0], known[-1]
            found += [least - first, *(number for _, number in known), most + len(part) - 1 - last]
    return found


def _object(name: str) -> str:
    """Return an object's name; of a subject with one segment of the same name that name."""
    subject, _, segment = name.partition(":")
    return subject if subject == segment else name


def _seconds(frame: str, rate: Fraction) -> str:
    """Return a frame's time in s, rounded to a billionth."""
    number = decimal(frame)
    billionths = round((Fraction(0) if number is None else number.exact()) / rate * 10**9)
    sign, size = "-" if billionths < 0 else "", abs(billionths)
    return f"{sign}{size // 10**9}.{size % 10**9:09d}"


def _qualisys(rows: _Rows, source: str, robots: Sequence[str], *, whole: bool) -> Exported:
    """Read Qualisys' export of bodies (6D): settings, one a line, then frames; lengths are in mm."""
    at = next((k for k, (_, row) in enumerate(rows) if row[:2] == ["Frame", "Time"]), None)
    about = {row[0]: row[1:] for _, row in rows[:at] if row}
    if about.get("DATA_INCLUDED", [""])[:1] != ["6D"]:
        raise BadInput(
            f"{source} is Qualisys' export of {(about.get('DATA_INCLUDED') or ['nothing'])[0]!r:.20}; export 6D data (bodies)."
        )
    if at is None:
        raise BadInput(f"{source} has no line 'Frame, Time, ...': export 6D data with the time of each frame.")
    header = rows[at][1]
    found, bodies, turned = [_NOTHING, "t", *[_NOTHING] * (len(header) - 2)], list[str](), list[list[int]]()
    for name in [name for name in about.get("BODY_NAMES", []) if name]:
        places = [k for k, cell in enumerate(header) if cell == f"{name} X"]
        if len(places) != 1 or header[places[0] + 1 : places[0] + 3] != ["Y", "Z"]:
            raise BadInput(f"{source} has {len(places)} columns '{name} X' that Y and Z follow; one is needed.")
        k = places[0]
        found[k : k + 3] = [f"{name}.{axis} (mm)" for axis in "xyz"]
        bodies += [name] * 3
        end = next((m for m in range(k + 3, len(header)) if header[m].endswith(" X")), len(header))
        turned.append([k, *[m for m in range(k + 3, end) if header[m].startswith("Rot[")]])
    _require_bodies(bodies, robots, source)
    seen = [(line, _unseen(row, turned)) for line, row in rows[at + 1 :]]
    wanted, rate = ((about.get(name) or [""])[0] for name in ("NO_OF_FRAMES", "FREQUENCY"))
    promised, lacks = _promised(rows[at + 1 :], wanted, rate, 1, source)
    said = "Qualisys' export: lengths in mm, times in s since its first frame; a body whose rotation is all zeros was not seen."
    return Exported(_table(seen, found, source, whole=whole), SAME, (said, *lacks), promised)


# five parameters: the frames that there are, and what the header says of them
def _promised(
    rows: _Rows, wanted: str, rate: str, first: int, source: str
) -> tuple[tuple[Fraction, Fraction] | None, tuple[str, ...]]:
    """Return from when to when an export goes by its header, s, and what it lacks in sentences: frames may be lost before its rows or after them.

    Args:
        rows: Frame, time and what was measured.
        wanted: How many frames the header promises; empty where it does not.
        rate: Frames a second, as the header says it.
        first: Number of an export's first frame.
        source: Names it in messages.
    """
    frames = [(decimal(row[0]), decimal(row[1])) for _, row in rows if len(row) > 1 and any(row)]
    known = [(frame.exact(), time.exact()) for frame, time in frames if frame is not None and time is not None]
    count = decimal(wanted)
    if count is None or not known or count.exact() <= len(known):
        return None, ()
    missing, each = count.exact() - (known[-1][0] - known[0][0] + 1), decimal(rate)
    if missing <= 0:
        return None, ()  # they are lost between its rows
    if each is None or each.whole <= 0:
        raise BadInput(
            f"{source} promises {wanted} frames and holds {len(known)}, and does not say how many there are a second, so that when it ended is "
            "not known: export it again."
        )
    before = min(max(known[0][0] - first, Fraction(0)), missing)
    said = f"its header promises {wanted} frames, and {len(known)} are there: for the others nobody was seen."
    return (known[0][1] - before / each.exact(), known[-1][1] + missing / each.exact()), (said,)


def _unseen(row: list[str], turned: list[list[int]]) -> list[str]:
    """Return a row with no position of bodies whose rotation is no rotation."""
    row = list(row)
    for k, *rotation in turned:
        numbers = [decimal(row[m]) for m in rotation if m < len(row)]
        if len(numbers) == 9 and all(number is not None and number.whole == 0 for number in numbers):
            row[k : k + 3] = ["", "", ""]
    return row


def _require_bodies(bodies: Sequence[str], robots: Sequence[str], source: str) -> None:
    """Reject an export that lacks a body, or holds one twice."""
    for robot in robots:
        if bodies.count(robot) not in (0, 3):
            raise BadInput(f"{source} has {bodies.count(robot)} columns for the position of '{robot}'; three are needed.")
        if robot not in bodies:
            known = list(dict.fromkeys(bodies))
            raise BadInput(
                f"{source} has no body '{robot}'.{did_you_mean(robot, known)} Bodies: {', '.join(known)[:200] or 'none'}. Say which it "
                f"is: --rename {robot}=NAME."
            )


def _table(rows: _Rows, header: list[str], source: str, *, whole: bool) -> Table:
    """Return a plain table of rows that all have as many cells as the header, but for empty ones at their ends."""
    kept, lines, width = list[list[str]](), list[int](), len(header)
    for line, row in rows:
        if not any(row):
            continue
        if len(row) < width or any(row[width:]):
            raise BadInput(f"{source}:{line}: {len(row)} cells under {width} columns.")
        kept.append(row[:width])
        lines.append(line)
    return Table(source, tuple(header), kept, lines, whole)
