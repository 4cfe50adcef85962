"""Upload to Crazyflies through cflib: the exact bytes of the trajectory memory, and a way to send them.

The export writes one `.bin` a robot and `upload.json`, which says what `define_trajectory` is told; that is the dry run.
`upload` sends the same bytes over the radio.
"""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from flight.exports.braking import AtMost
from flight.exports.crazyflies.fits import held_at_once, require_crazyflie, require_held
from flight.exports.crazyflies.memory import MEMORY, PIECE, Entry, poly4d_bytes, side_by_side
from flight.exports.crazyflies.parameters import NUMBERS, cannot_fly
from flight.exports.parts import notes_on, order_of, parts_of
from flight.exports.target import ExportTarget, Product, Request
from verify.data import BadInput, DoesNotFit, LtlplanError, MissingEngine, Trajectory
from verify.data.storage.safe_reading import parse_json, read_bytes
from verify.data.trajectory import PAUSE, PIECES

KINDS = ("poly4d", "poly4d_compressed")
_POLY4D = 0
_BYTES = "Each .bin holds the exact bytes for the vehicle's trajectory memory, at the offset in upload.json."
_FLOWN = (
    "These files set no parameters and start nothing: `ltlplan fly RUN --link crazyflie` sets and reads back what was simulated, uploads the certified "
    "flight with a climb before it and a landing behind it, and flies and watches all of it."
)
_MOST = 1_000_000
"""Bytes of a file of an export; a vehicle holds four thousand."""


def upload_files(request: Request, encode: Callable[[str, Trajectory], tuple[bytes, int]], kind: int) -> Product:
    """Return `<robot>.bin` for each robot, and upload.json.

    Args:
        request: The export.
        encode: Turns a robot's name and finite flight into bytes and a number of pieces.
        kind: 0 for Poly4D, 1 for compressed.

    Raises:
        BadInput: `trajectory_ids` names a robot that there is not.
        DoesNotFit: The vehicle is no Crazyflie, or its memory cannot hold the flight.
    """
    require_crazyflie(request)
    ids, begin = request.options.get("trajectory_ids", {}), request.options.get("offset", 0)
    unknown = sorted(set(ids) - set(request.team))
    if unknown:
        raise BadInput(f"trajectory_ids names '{unknown[0]}', which is not a robot of the mission: {', '.join(request.team)}.")
    files: dict[str, bytes] = {}
    rows: dict[str, list[dict[str, Any]]] = {name: [] for name in request.team}
    parts = parts_of(request)
    for part in parts:
        for name, path in part.paths.items():
            data, pieces = encode(name, path)
            trajectory_id = ids.get(name, 0)
            held = held_at_once(request.mission, name)
            size = MEMORY if held == PIECES else PIECE * held
            (entry,) = side_by_side({trajectory_id: (name, data, pieces)}, kind, begin, size)
            files[f"{name}{part.ending}.bin"] = entry.data
            rows[name].append(
                {
                    "file": f"{name}{part.ending}.bin",
                    "trajectory_id": entry.trajectory_id,
                    "offset": entry.offset,
                    "pieces": entry.pieces,
                    "type": KINDS[kind],
                    "duration": path.duration,
                    "start": [float(x) for x in path.evaluate(0.0)],
                }
            )
    table: dict[str, Any] = {name: found[0] if len(parts) == 1 else {"parts": found} for name, found in rows.items()}
    content = {"mission": request.mission.name, "certificate": request.digest, "margin": request.margin, "robots": table}
    if len(parts) > 1:
        content |= {"order": [index + 1 for index in order_of(request)], "pause": PAUSE}
    files["upload.json"] = (json.dumps(content, indent=1) + "\n").encode()
    return Product(files, (_BYTES, _FLOWN, *notes_on(request, parts)))


@dataclass(frozen=True, slots=True)
class Uploaded:
    """Bytes that were sent to one vehicle, or would have been.

    Attributes:
        robot: Name.
        uri: Radio address.
        entry: Id, offset, number of pieces, kind and the exact bytes.
    """

    robot: str
    uri: str
    entry: Entry

    @property
    def data(self) -> bytes:
        """The exact bytes."""
        return self.entry.data


def upload(
    folder: str | os.PathLike[str], uris: Mapping[str, str], *, dry_run: bool = False, part: int = 1
) -> tuple[Uploaded, ...]:
    """Send an exported folder's trajectories to Crazyflies over the radio.

    Nothing is started. Several exports with other ids and offsets can lie side by side in one vehicle. Of a flight in parts one is sent;
    a vehicle that has flown another one has to be held by a go-to first, for at a trajectory's end it still reads its memory.

    Args:
        folder: Written by `export(..., format="crazyflie")` or `"crazyflie-compressed"`.
        uris: Radio address of each robot.
        dry_run: Send nothing; return what would be sent.
        part: Which one, from 1, of a flight in parts.

    Raises:
        BadInput: The folder is no such export or has no such part, an address is missing, or there is no radio or vehicle to be reached by it.
        DoesNotFit: A vehicle's memory is smaller, or it refuses the bytes.
        MissingEngine: cflib is not installed.
    """
    planned = _read(Path(folder), uris, part)
    for number, item in enumerate(() if dry_run else planned):
        try:
            with _quiet():
                _send(item)
        except LtlplanError:
            raise
        except Exception as error:  # cflib raises bare ones: no radio, no vehicle, no such address
            reason = (str(error).splitlines() or [type(error).__name__])[0].removesuffix(".")
            sent = ", ".join(before.robot for before in planned[:number]) or "no robot"
            raise BadInput(
                f"{item.robot} at {item.uri} cannot be sent to: {reason}. What was exported is in {folder}; {sent} has been sent its "
                f"trajectory so far, and nothing was started. Plug in the radio, switch the vehicle on, and look at the address."
            ) from None
    return planned


@contextmanager
def _quiet() -> Generator[None]:
    """Keep what cflib logs of a failure, tracebacks too, off standard error where nobody listens to logs: it is raised as well."""
    logger, handler = logging.getLogger("cflib"), logging.NullHandler()
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


def write_entry(memory: Any, entry: Entry) -> bool:  # of any type: cflib has none
    """Write an entry's bytes through cflib's trajectory memory element, and tell whether it succeeded."""

    class _Bytes:
        def pack(self) -> bytes:
            return entry.data

    memory.trajectory = [_Bytes()]
    return bool(memory.write_data_sync(start_addr=entry.offset))


def _read(folder: Path, uris: Mapping[str, str], part: int) -> tuple[Uploaded, ...]:
    try:
        robots = parse_json(read_bytes(folder / "upload.json", most=_MOST, what="upload.json"), "upload.json")["robots"]
        parts = {name: _part(folder, name, row, part) for name, row in robots.items()}
    except (ValueError, KeyError, TypeError, AttributeError, BadInput) as error:
        raise BadInput(f"{folder} is no Crazyflie export: {str(error).removesuffix('.')}.") from None
    items: list[Uploaded] = []
    for name, (trajectory_id, offset, pieces, kind, data) in parts.items():
        if name not in uris:
            raise BadInput(f"no radio address for '{name}'; robots: {', '.join(parts)}.")
        (entry,) = side_by_side({trajectory_id: (name, data, pieces)}, kind, offset)
        items.append(Uploaded(name, uris[name], entry))
    return tuple(items)


def _part(folder: Path, name: str, row: Mapping[str, Any], part: int) -> tuple[int, int, int, int, bytes]:
    """Return a robot's trajectory id, offset, number of pieces, kind and bytes."""
    parts = row.get("parts", [row])
    if not 1 <= part <= len(parts):
        raise BadInput(f"it has {len(parts)} part{'s' * (len(parts) > 1)}, and no part {part}")
    file = f"{name}-part{part}.bin" if "parts" in row else f"{name}.bin"
    row = parts[part - 1]
    numbers = [row[key] for key in ("trajectory_id", "offset", "pieces")]
    if row["file"] != file or Path(name).name != name or not all(type(number) is int for number in numbers):
        raise BadInput(f"what upload.json says of '{name[:40]}' is not what an export writes")
    return (*numbers, KINDS.index(row["type"]), read_bytes(folder / file, most=_MOST, what="trajectory"))


def _send(item: Uploaded) -> None:
    """Open a link, write and define the trajectory, close it."""
    try:
        import cflib.crtp
        from cflib.crazyflie import Crazyflie
        from cflib.crazyflie.mem import MemoryElement
        from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
    except ImportError:
        raise MissingEngine("uploading needs cflib: pip install 'ltlplan[crazyflie]'.") from None
    cflib.crtp.init_drivers()
    with SyncCrazyflie(item.uri, cf=Crazyflie()) as link:
        memories = link.cf.mem.get_mems(MemoryElement.TYPE_TRAJ)
        if not memories:
            raise DoesNotFit(f"{item.robot} at {item.uri} has no trajectory memory.")
        if memories[0].size < item.entry.offset + len(item.entry.data):
            raise DoesNotFit(f"{item.robot}'s trajectory memory has {memories[0].size} bytes, too few.")
        if not write_entry(memories[0], item.entry):
            raise DoesNotFit(f"{item.robot} at {item.uri} did not take the trajectory.")
        link.cf.high_level_commander.define_trajectory(
            item.entry.trajectory_id, item.entry.offset, item.entry.pieces, type=item.entry.kind
        )


def _product(request: Request) -> Product:
    def encode(name: str, path: Trajectory) -> tuple[bytes, int]:
        require_held(request.mission, name, path)
        return poly4d_bytes(name, path), len(path)

    return upload_files(request, encode, _POLY4D)


OPTIONS = {"trajectory_ids": "robot to the trajectory's id, 0 to 30", "offset": "bytes from the memory's start"}
VOIDS = (
    "a `time_scale` other than 1 (below 1 also breaks the vehicle's limits)",
    "`relative_position=True`, `relative_yaw=True` or `reversed=True` in start_trajectory",
    "writing another trajectory over the same part of the memory",
)
CRAZYFLIE = ExportTarget(
    name="crazyflie",
    make=_product,
    options=OPTIONS,
    voids=VOIDS,
    send=upload,
    in_parts=True,
    join=AtMost(PIECES),
    controllers=tuple(NUMBERS),
    cannot_fly=cannot_fly,
)
