"""Motions that are recorded in every format that is read, with ends lost, bodies dropped and stamps written coarsely; and what was truly flown.

Nothing of the judge is used here. A motion is a polyline that is never faster than its speed. A recording of it holds what a receiver would:
robots while they were seen, another body all the time, headers that promise more frames than there are, dropouts, stamps with few digits,
places as the laboratory sees them. The truth is looked at every millisecond.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

import flight
from flight import RecordingOptions
from tests.helpers.live import foreign_logs
from tests.helpers.live.recorded_flights import Made, passing
from tests.helpers.live.recordings import darting, dense
from verify import certify
from verify.data import Mission, mission_to_yaml, parse_mission
from verify.data.events import HoopMoves, events_to_json
from verify.data.frame import Frame

RATE = 50
"""Frames a second."""
RADIUS = 0.3
"""m, of both regions."""
STRANGER = "cart"
"""A body that is none of the mission's."""
FORMULAS = ("G !b", "F a & G !b", "!b U a", "F a")
NEAR = 0.002
"""m; how near to a border the truth is taken for unknown."""

Places = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Motion:
    """What was truly flown.

    Attributes:
        mission: What was asked; its regions are balls.
        formula: One of `FORMULAS`.
        ways: Of each robot times (s) and corners (m) of its polyline.
        end: When it ends, s; it begins at 0.
        speed: Which nobody exceeds, m/s.
        moved: When region b went to another place, s of the flight, and where to; None where it stays.
    """

    mission: Mission
    formula: str
    ways: Mapping[str, tuple[np.ndarray, np.ndarray]]
    end: float
    speed: float
    moved: tuple[float, tuple[float, float, float]] | None

    def places(self, times: np.ndarray) -> Places:
        """Return where all were, m. Shape (n, 3) each."""
        return {name: dense(times, *way) for name, way in self.ways.items()}

    def satisfied(self, start: float) -> bool | None:
        """Tell whether what was flown from `start` to the end satisfies the formula and keeps all apart; None where that is too near to tell."""
        times = np.unique(np.r_[np.arange(start, self.end, 0.001), self.end, *(at for at, _ in self.ways.values())])
        times = times[times >= start]
        found = [self._satisfied(times, start, NEAR), self._satisfied(times, start, -NEAR)]
        return found[0] if found[0] == found[1] else None

    def _satisfied(self, times: np.ndarray, start: float, slack: float) -> bool:
        """Judge the samples, with regions that are larger by `slack` where that breaks the formula, and smaller where it does not."""
        places, regions = self.places(times), self.mission.regions
        apart = [
            np.linalg.norm(one - other, axis=1).min() >= self.mission.separation + slack
            for name, one in places.items()
            for again, other in places.items()
            if name < again
        ]

        def within(name: str, by: float) -> np.ndarray:
            centre = np.tile(np.array(regions[name].center), (len(times), 1))
            if name == "b" and self.moved is not None:
                centre[times >= start + self.moved[0]] = self.moved[1]
            each = [np.linalg.norm(path - centre, axis=1) <= RADIUS + by for path in places.values()]
            return np.logical_or.reduce(each)

        a, b = within("a", -slack), within("b", slack)
        first_a, first_b = (int(np.argmax(row)) if row.any() else len(times) for row in (a, b))
        kept = {
            "G !b": not b.any(),
            "F a": bool(a.any()),
            "F a & G !b": bool(a.any()) and not b.any(),
            "!b U a": first_a < min(first_b, len(times)),
        }
        return kept[self.formula] and all(apart)


@dataclass(frozen=True, eq=False)
class Tape:
    """What a receiver has of a motion.

    Attributes:
        times: Of its frames, s of the motion. Shape (n,).
        seen: Robots, m, in the frame of the file; NaN where one was not seen. Shape (n, 3) each.
        stranger: Another body, seen all the time. Shape (n, 3).
        digits: After the point of stamps, where a format leaves that open.
        renamed: Whether robots that are not seen stand in the file under a name in another case.
    """

    times: np.ndarray
    seen: Places
    stranger: np.ndarray
    digits: int
    renamed: Mapping[str, np.ndarray]

    @property
    def bodies(self) -> Places:
        """All that have a place in the file."""
        return {**self.seen, STRANGER: self.stranger, **self.renamed}

    @property
    def frames(self) -> slice:
        """Frames from the first in which a robot was seen to the last: all that a file has that promises more."""
        seen = np.flatnonzero(np.logical_or.reduce([~np.isnan(row[:, 0]) for row in self.seen.values()]))
        return slice(int(seen[0]), int(seen[-1]) + 1)


# -- motions ---------------------------------------------------------------------------------------------------------


def draw_motion(rng: np.random.Generator, *, changing: bool) -> Motion:
    """Return a motion of one robot or two past a region to visit and one to keep out of.

    Args:
        rng: Draws it.
        changing: Whether a region moves meanwhile.
    """
    formula, end = str(rng.choice(FORMULAS)), float(rng.integers(4, 9))
    speed, robots = float(rng.uniform(0.8, 2.0)), int(rng.integers(1, 3))
    frame = ""
    if rng.random() < 0.5:
        offset = [round(float(x), 3) for x in rng.uniform(-2, 2, 3)]
        frame = f"frame: {{rotation_deg: {float(rng.integers(-180, 180))}, offset: {offset}}}"
    agents = "\n".join(f"  r{k}: {{start: [{-1.0 - 0.5 * k}, 0.0, 1.0]}}" for k in range(robots))
    mission = parse_mission(
        f'format: 1\nname: hunted\nspec: {{formula: "{formula}"}}\nregions:\n  a: {{center: [1.0, 0.0, 1.0], radii: [{RADIUS}, {RADIUS}, {RADIUS}]}}\n'
        f"  b: {{center: [0.0, 1.0, 1.0], radii: [{RADIUS}, {RADIUS}, {RADIUS}]}}\nagents:\n{agents}\nvehicle: crazyflie-2.1\n"
        f"workspace: {{min: [-6.0, -6.0, -6.0], max: [6.0, 6.0, 6.0]}}\nseparation: 0.3\nmargin: 0.0\n{frame}\n"
    )
    times = np.arange(0, round(end * RATE) + 1) / RATE
    ways: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    for k in range(robots):
        base = _base(times, speed, rng) + np.array([0.0, 0.0, 0.0 if k == 0 else float(rng.choice([-0.45, 0.8]))])
        ways[f"r{k}"] = darting(times, base, speed, rng, share=float(rng.choice([0.0, 0.1])))
    moved = (float(rng.uniform(0.2, 0.8)) * end, (0.0, float(rng.uniform(-1.2, -0.6)), 1.0)) if changing else None
    return Motion(mission, formula, ways, float(times[-1]), speed, moved)


def _base(times: np.ndarray, speed: float, rng: np.random.Generator) -> np.ndarray:
    """Return places at frames on a way from one drawn stop to the next: near the regions, in them, or far from both."""
    stops = {
        "a": (1.0, 0.0, 1.0),
        "b": (0.0, 1.0, 1.0),
        "past": (0.0, 0.66, 1.0),
        "away": (1.0, -1.2, 1.2),
        "back": (-1.0, -0.3, 0.9),
    }
    chosen = [stops[str(name)] for name in rng.choice(list(stops), size=5, p=[0.3, 0.15, 0.15, 0.2, 0.2])]
    corners = np.array([(-1.0, 0.0, 1.0), *chosen]) + rng.uniform(-0.05, 0.05, (6, 3))
    pace = speed * float(rng.uniform(0.4, 0.95))
    at = np.r_[0.0, np.cumsum(np.maximum(np.linalg.norm(np.diff(corners, axis=0), axis=1), 0.1) / pace)]
    return dense(times, at, corners)


@cache
def certified(turned: bool) -> Made:
    """Return a certified flight of two robots that pass each other.

    Args:
        turned: Whether its mission lies turned in the laboratory.
    """
    plan, team, _ = passing()
    frame = Frame(rotation_deg=40.0, offset=(1.0, 2.0, 0.5)) if turned else None
    plan = plan.model_copy(update={"mission": plan.mission.model_copy(update={"frame": frame})})
    return plan, team, certify(plan, team)


@dataclass(frozen=True, eq=False)
class Flown:
    """How a certified flight was truly flown: near its plan, in it or not.

    Attributes:
        made: Plan, trajectories and certificate.
        ways: Of each robot times (s) and corners (m) of its polyline.
        end: When the polylines end, s.
        speed: Which nobody exceeds, m/s.
    """

    made: Made
    ways: Mapping[str, tuple[np.ndarray, np.ndarray]]
    end: float
    speed: float

    @property
    def mission(self) -> Mission:
        """What was asked."""
        return self.made[0].mission

    def places(self, times: np.ndarray) -> Places:
        """Return where all were, m. Shape (n, 3) each."""
        return {name: dense(times, *way) for name, way in self.ways.items()}

    @property
    def furthest(self) -> float:
        """How far anybody was from its plan at the most, m."""
        _, team, certificate = self.made
        times = np.unique(np.r_[np.arange(0, certificate.duration, 0.001), *(at for at, _ in self.ways.values())])
        times = times[(times >= 0) & (times <= certificate.duration)]
        found = self.places(times)
        return max(
            float(np.linalg.norm(found[name] - path.evaluate(times)[:, :3], axis=1).max()) for name, path in team.items()
        )


def draw_flown(rng: np.random.Generator) -> Flown:
    """Return a certified flight as it was flown: off its plan here and there, by less than its margin or more, and hovering before and after.

    Args:
        rng: Draws it.
    """
    made = certified(bool(rng.random() < 0.5))
    _, team, certificate = made
    end = certificate.duration + 2.0
    times = np.arange(-2 * RATE, round(end * RATE) + 1) / RATE
    ways: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    late = float(rng.choice([0.0, 0.0, 0.0, 0.01, 0.03]))
    for name, path in team.items():
        place = path.evaluate(np.clip(times - late, 0, path.duration))[:, :3]
        when, width = float(rng.uniform(0, certificate.duration)), float(rng.uniform(0.2, 0.6))
        way = rng.normal(size=3)
        off = way / np.linalg.norm(way) * certificate.margin * float(rng.choice([0.0, 0.0, 0.3, 0.6, 0.97, 1.1, 2.0]))
        place = place + np.exp(-(((times - when) / width) ** 2))[:, None] * off
        ways[name] = (times, place)
    steps = [np.linalg.norm(np.diff(place, axis=0), axis=1).max() for _, place in ways.values()]
    return Flown(made, ways, float(times[-1]), float(max(steps)) * RATE * float(rng.uniform(1.0, 1.1)))


# -- recordings ------------------------------------------------------------------------------------------------------


def draw_tape(motion: Motion | Flown, begin: float, error: float, rng: np.random.Generator, *, ends: bool = True) -> Tape:
    """Return what a receiver has that listens from `begin` to the motion's end, and loses robots at either end or in between.

    Args:
        motion: What was flown.
        begin: s, a multiple of a frame.
        error: By which a place is off at the most, m.
        rng: Draws the faults.
        ends: Whether robots may be lost at an end, which a format cannot show whose rows hold all robots and nothing else.
    """
    frames = np.arange(round(begin * RATE), round(motion.end * RATE) + 1) / RATE
    frames = frames[:: int(rng.choice([1, 1, 1, 2]))]
    seen, renamed = motion.places(frames), dict[str, np.ndarray]()
    noise = rng.normal(size=(len(frames), 3))
    noise *= error * (1 - 1e-6) / np.linalg.norm(noise, axis=1, keepdims=True)
    seen = {name: path + noise for name, path in seen.items()}
    loses = rng.choice(["nothing", "end", "beginning", "both", "middle"], p=[0.4, 0.25, 0.15, 0.1, 0.1])
    loses = "middle" if not ends and loses != "nothing" else loses
    together = bool(rng.random() < 0.5)
    cut = [int(rng.uniform(0.1, 0.6) * len(frames)) for _ in range(2)]
    for name in seen:
        if not together:
            cut = [int(rng.uniform(0.1, 0.6) * len(frames)) for _ in range(2)]
        lost = np.zeros(len(frames), dtype=bool)
        if loses in ("end", "both"):
            lost[max(len(frames) - cut[0], 3) :] = True
        if loses in ("beginning", "both"):
            lost[: min(cut[1], len(frames) // 3)] = True
        if loses == "middle":
            lost[len(frames) // 3 : len(frames) // 3 + cut[0] // 2] = True
        if rng.random() < 0.3 and lost.any():
            renamed[name.upper()] = np.where(lost[:, None], seen[name], np.nan)
        seen[name] = np.where(lost[:, None], np.nan, seen[name])
    return Tape(frames, seen, np.tile([2.0, 2.0, 0.5], (len(frames), 1)), int(rng.choice([1, 2, 2, 3, 6, 6])), renamed)


def in_laboratory(tape: Tape, mission: Mission) -> Tape:
    """Return a tape whose places are as the laboratory sees them.

    Args:
        tape: In the mission's frame.
        mission: Carries the frame.
    """
    if mission.frame is None:
        return tape
    turned = {name: mission.frame.to_laboratory(row) for name, row in tape.seen.items()}
    again = {name: mission.frame.to_laboratory(row) for name, row in tape.renamed.items()}
    return replace(tape, seen=turned, renamed=again)


Writer = Callable[[Path, Tape, np.random.Generator], tuple[Path, Mapping[str, float], RecordingOptions]]
"""Writes a tape into a folder; returns the recording, each robot's clock at the motion's time 0, s, and what else is to be told."""


def _one_clock(tape: Tape, shift: float) -> dict[str, float]:
    return dict.fromkeys(tape.seen, shift)


def _table(
    path: Path, tape: Tape, rng: np.random.Generator, *, long: bool
) -> tuple[Path, Mapping[str, float], RecordingOptions]:
    shift = float(rng.integers(0, 1_000_000))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    stamps = [f"{time + shift:.{tape.digits}f}" for time in tape.times.tolist()]
    last = len(stamps) - 1  # of frames with one stamp the first is kept, and of the last ones the very last
    kept = [k for k in range(last) if stamps[k] != stamps[last] and (k == 0 or stamps[k] != stamps[k - 1])] + [last]

    def cells(place: np.ndarray) -> list[str]:
        return ["", "", ""] if np.isnan(place[0]) else [f"{value:.6f}" for value in place]

    bodies = tape.bodies
    if long:
        writer.writerow(["t", "robot", "x", "y", "z"])
        for k in kept:
            writer.writerows([stamps[k], name, *cells(row[k])] for name, row in bodies.items() if not np.isnan(row[k][0]))
    else:
        writer.writerow(["t", *(f"{name}.{axis}" for name in bodies for axis in "xyz")])
        for k in kept:
            writer.writerow([stamps[k], *(cell for row in bodies.values() for cell in cells(row[k]))])
    (path / "log.csv").write_text(out.getvalue())
    return path / "log.csv", _one_clock(tape, shift), RecordingOptions()


def _vicon(path: Path, tape: Tape, rng: np.random.Generator) -> tuple[Path, Mapping[str, float], RecordingOptions]:
    """With blank lines for frames that were lost, all of them or one, or with another part that goes on."""
    every = round((tape.times[1] - tape.times[0]) * RATE)
    first = int(rng.integers(1, 400)) * every
    shift = first / RATE - float(tape.times[0])
    text = foreign_logs.vicon(tape.times, tape.bodies, rate=RATE, frame=0)
    lines = text.splitlines()
    rows = [f"{first + every * k},{line.split(',', 1)[1]}" for k, line in enumerate(lines[5:])]
    how = rng.choice(["stranger", "blank line", "another part"])
    if how == "blank line":
        rows[int(rng.integers(1, len(rows) - 1))] = ""
    if how == "another part":
        keep = tape.frames
        markers = ["", "Trajectories", str(RATE), ",,cart:one,,", "Frame,Sub Frame,X,Y,Z", ",,mm,mm,mm"]
        markers += [f"{first + every * k},0,1,2,3" for k in range(len(rows))]
        rows = rows[keep] + markers
    (path / "log.csv").write_text("\n".join([*lines[:5], *rows]) + "\n")
    return path / "log.csv", _one_clock(tape, shift), RecordingOptions()


def _promising(
    path: Path, tape: Tape, rng: np.random.Generator, *, motive: bool
) -> tuple[Path, Mapping[str, float], RecordingOptions]:
    """With all frames in which somebody was seen, or all; the header promises all."""
    keep = tape.frames if rng.random() < 0.7 else slice(0, len(tape.times))
    zero, bodies = float(tape.times[0]), {name: row[keep] for name, row in tape.seen.items()}
    written, first = (foreign_logs.motive, 0) if motive else (foreign_logs.qualisys, 1)
    text = written(tape.times[keep] - zero, bodies, promised=len(tape.times), frame=keep.start + first)
    rate = 1 / float(tape.times[1] - tape.times[0])
    text = text.replace("Export Frame Rate,100.000000", f"Export Frame Rate,{rate:.6f}").replace(
        "FREQUENCY\t100", f"FREQUENCY\t{rate:g}"
    )
    (path / "log.csv").write_text(text)
    return path / "log.csv", _one_clock(tape, -zero), RecordingOptions(axes="x,-z,y" if motive else "")


def _by_robot(
    path: Path, tape: Tape, rng: np.random.Generator, *, kind: str
) -> tuple[Path, Mapping[str, float], RecordingOptions]:
    """A file for each robot: logs of Crazyflies whose rows go on without a position, PX4's with dropouts, or tables with other bodies."""
    folder, boots = path / "logs", dict[str, float]()
    folder.mkdir()
    for name, row in tape.seen.items():
        boots[name] = boot = float(rng.integers(5, 500))
        seen = np.flatnonzero(~np.isnan(row[:, 0]))
        if kind == "ulog":
            at, lost = tape.times[seen], dict[int, float]()
            for before in [0, *(np.flatnonzero(np.diff(seen) > 1) + 1).tolist(), len(seen)]:
                low = tape.times[0] if before == 0 else at[before - 1]
                high = tape.times[-1] if before == len(seen) else at[before]
                if high > low:
                    lost[before] = float(high - low)
            (folder / f"{name}.ulg").write_bytes(
                foreign_logs.ulog(at, row[seen], booted=boot, began=float(tape.times[0]), lost=lost)
            )
        elif kind == "crazyflie":
            lines = ["Timestamp,stateEstimate.x,stateEstimate.y,stateEstimate.z,pm.vbat"]
            for time, place in zip(tape.times, row, strict=True):
                cells = ",,," if np.isnan(place[0]) else ",".join(f"{value:.6f}" for value in place) + ","
                lines.append(f"{int(1000 * (time + boot) + 1e-6)},{cells}3.9")
            (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
        else:
            alone = Tape(tape.times, {name: row}, tape.stranger, tape.digits, {})
            found, clocks, _ = _table(folder, alone, rng, long=True)
            found.rename(folder / f"{name}.csv")
            boots[name] = clocks[name]
    return folder, boots, RecordingOptions()


def _bag(kind: str, *, mcap: bool) -> Writer:
    def write(path: Path, tape: Tape, rng: np.random.Generator) -> tuple[Path, Mapping[str, float], RecordingOptions]:
        zero = 1_700_000_000 + int(rng.integers(0, 1000))
        foreign_logs.bag(path / "bag", tape.times, tape.bodies, kind=kind, mcap=mcap, zero=zero)
        return path / "bag", _one_clock(tape, float(zero)), RecordingOptions()

    return write


def _our_mcap(path: Path, tape: Tape, rng: np.random.Generator) -> tuple[Path, Mapping[str, float], RecordingOptions]:
    foreign_logs.our_mcap(path / "flight.mcap", tape.times, tape.seen)
    return path / "flight.mcap", _one_clock(tape, 0.0), RecordingOptions()


def _our_table(ending: str) -> Writer:
    def write(path: Path, tape: Tape, rng: np.random.Generator) -> tuple[Path, Mapping[str, float], RecordingOptions]:
        robots = tuple(tape.seen)
        kept = np.logical_and.reduce([~np.isnan(row[:, 0]) for row in tape.seen.values()])
        position = np.stack([row[kept] for row in tape.seen.values()], axis=1)
        zeros, count = np.zeros_like(position), int(kept.sum())
        letters = ((frozenset[str](),) * len(robots),) * count
        log = flight.FlightLog(
            "hunted", robots, tape.times[kept], position, zeros, zeros, zeros[..., 0], zeros, zeros[..., 0], letters
        )
        flight.write_log(log, path / f"flight{ending}")
        return path / f"flight{ending}", _one_clock(tape, 0.0), RecordingOptions()

    return write


WRITERS: dict[str, Writer] = {
    "long table": lambda path, tape, rng: _table(path, tape, rng, long=True),
    "wide table": lambda path, tape, rng: _table(path, tape, rng, long=False),
    "tables by robot": lambda path, tape, rng: _by_robot(path, tape, rng, kind="table"),
    "Vicon": _vicon,
    "Motive": lambda path, tape, rng: _promising(path, tape, rng, motive=True),
    "Qualisys": lambda path, tape, rng: _promising(path, tape, rng, motive=False),
    "Crazyflie": lambda path, tape, rng: _by_robot(path, tape, rng, kind="crazyflie"),
    "PX4": lambda path, tape, rng: _by_robot(path, tape, rng, kind="ulog"),
    "PoseStamped, sqlite3": _bag("PoseStamped", mcap=False),
    "PoseWithCovarianceStamped, mcap": _bag("PoseWithCovarianceStamped", mcap=True),
    "PointStamped, mcap": _bag("PointStamped", mcap=True),
    "TransformStamped, sqlite3": _bag("TransformStamped", mcap=False),
    "Odometry, mcap": _bag("Odometry", mcap=True),
    "NamedPoseArray, mcap": _bag("NamedPoseArray", mcap=True),
    "our log, mcap": _our_mcap,
    "our log, csv": _our_table(".csv"),
    "our log, parquet": _our_table(".parquet"),
}
"""All formats that are read."""

OURS = frozenset(name for name in WRITERS if name.startswith("our log"))
"""In the mission's frame, on the flight's clock, without anything that is not known."""


WHOLE = frozenset({"our log, csv", "our log, parquet"})
"""With a row for all robots or none."""


def write_asked(folder: Path, motion: Motion) -> Path:
    """Write what was asked: a mission file, or a folder with what changed in flight.

    Args:
        folder: Where to.
        motion: What was flown.
    """
    (folder / "mission.yaml").write_text(mission_to_yaml(motion.mission))
    if motion.moved is None:
        return folder / "mission.yaml"
    (folder / "events.json").write_text(events_to_json([HoopMoves(time=motion.moved[0], region="b", center=motion.moved[1])]))
    return folder
