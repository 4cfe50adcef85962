"""Work that is derived from a job's certified flight: campaigns, rehearsals, and recordings that were judged against it.

Each is a job `of` that job with one stage, named by its kind; exports (`exporting`) are, too.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ltlplan.service.execution.serialization import from_bytes, to_bytes
from ltlplan.service.models import DerivedKind, Problem
from ltlplan.service.problems import problem_of
from ltlplan.service.queries import as_json, without_places
from ltlplan.service.recordings import RecordingAsked
from verify.data import NotCertified
from verify.data.progress import Progress, part_of

if TYPE_CHECKING:
    from flight.rehearsal.combinations import Combinations

Plain = Mapping[str, Any]  # of any type: JSON nests
Files = tuple[tuple[str, bytes], ...]

VERDICT = "verdict.json"
SHOWN = "shown.json"
"""What the page shows of a verdict: sentences, claims, and where the robots were."""


class Derived(Protocol):
    """Request for something that is made of a job's flight."""

    @property
    def kind(self) -> DerivedKind:
        """Kind of it; the name of its stage, too."""
        ...

    @property
    def title(self) -> str:
        """Kind and options in words."""
        ...

    @property
    def recording(self) -> bytes:
        """Bytes that were sent with the request; empty for none."""
        ...

    def plain(self) -> dict[str, Any]:
        """Return what is asked as plain data."""
        ...


@dataclass(frozen=True, slots=True)
class SimulationAsked:
    """Request for a campaign or a rehearsal.

    Attributes:
        kind: Which of them.
        options: Those of the command of that name that were given, by their names in Python.
    """

    kind: DerivedKind
    options: Plain

    @property
    def title(self) -> str:
        """Kind and options in words."""
        said = ", ".join(f"{name} {_said(value)}" for name, value in self.options.items())
        return f"{self.kind}: {said}" if said else f"{self.kind} with the usual options"

    @property
    def recording(self) -> bytes:
        """Bytes that were sent with it: none."""
        return b""

    def plain(self) -> dict[str, Any]:
        """Return what is asked as plain data."""
        return dict(self.options)


@dataclass(frozen=True, slots=True)
class RecordingKept:
    """Request to judge a recording and keep it.

    Attributes:
        name: Of its file.
        said: What is said of it.
        recording: Its bytes.
    """

    name: str
    said: RecordingAsked
    recording: bytes
    kind: DerivedKind = "recording"

    @property
    def title(self) -> str:
        """Kind and options in words."""
        return f"recording {self.name}"

    def plain(self) -> dict[str, Any]:
        """Return what is asked as plain data."""
        given = {field: getattr(self.said, field) for field in RecordingAsked.__slots__}
        return {
            "name": self.name,
            "said": {key: list(value) if isinstance(value, tuple) else value for key, value in given.items()},
        }


def derived_bytes(asked: Derived, files: Mapping[str, bytes]) -> bytes:
    """Return what a derived job is made of, as the bytes that its stage takes.

    Args:
        asked: What is asked.
        files: What the flight's job has made.
    """
    arrays = {name: np.frombuffer(data, dtype=np.uint8) for name, data in files.items()}
    sent = (np.frombuffer(asked.recording, dtype=np.uint8),) if asked.recording else ()
    return to_bytes((asked.plain(), arrays, *sent))


@dataclass(frozen=True, slots=True)
class Made:
    """Outcome of derived work.

    Attributes:
        found: What was found, as plain data for people.
        files: What is kept, by name.
        problem: Why it has failed, where it has something to show for it.
    """

    found: dict[str, Any]  # of any type: JSON nests
    files: Files
    problem: Problem | None = None


def derive(kind: str, value: bytes, progress: Progress) -> Made:
    """Do derived work.

    Args:
        kind: What is done.
        value: What `derived_bytes` made.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        LtlplanError: It is not done, and why.
    """
    plain, files, *sent = from_bytes(value)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for name, data in files.items():
            (folder / "run" / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / "run" / name).write_bytes(data.tobytes())
        with without_places(folder):
            return _WORK[kind](plain, folder, sent[0].tobytes() if sent else b"", progress)


def require_sense(kind: str, options: Plain, report: Progress) -> None:
    """Reject a campaign or rehearsal that makes no sense for any flight, before it is accepted.

    Args:
        kind: Which of them.
        options: Its options.
        report: Receives nothing.

    Raises:
        BadInput: There are no such conditions.
    """
    del report
    from flight import MotionCapture
    from flight.condition_options import Said

    if kind == "campaign":
        Said(**_conditions(options)).require_sense()
    else:
        _combinations(options)
        MotionCapture.parse(options.get("noise", "0.001"))


def _export(plain: Plain, folder: Path, _sent: bytes, progress: Progress) -> Made:
    from ltlplan.service.execution.exporting import ExportAsked, export_archive

    name, packed = export_archive(ExportAsked(**plain), folder / "run", progress)
    return Made({"files": [name]}, ((name, packed),))


def _campaign(plain: Plain, folder: Path, _sent: bytes, progress: Progress) -> Made:
    from flight import campaign
    from flight.condition_options import Said
    from ltlplan.output import write_campaign
    from verify.run_folder import proved_run

    progress("proving the certificate again", 0.0)
    run = proved_run(folder / "run")
    conditions = Said(**_conditions(plain)).conditions(run.plan.mission)
    seed = plain.get("seed")
    found = campaign(
        run.plan, run.team, run.certificate, runs=plain.get("runs", 100), seed=run.plan.seed if seed is None else seed,
        conditions=conditions, progress=part_of(progress, 0.2, 0.95),
    )  # fmt: skip
    with _written(folder) as made:
        write_campaign(run.plan, found, made)
        data = {name: value for name, value in found.to_dict().items() if name != "runs"}
        told = {**data, "sentences": [*found.sentences, conditions.sentence], "conditions": conditions.sentence}
        refusal = NotCertified(
            f"Seeds {found.contradictions[:5]} flew inside the tube and broke the formula: a bug of the certificate."
        )
        return Made(told, _files(made), problem_of(refusal) if found.contradictions else None)


def _rehearsal(plain: Plain, folder: Path, _sent: bytes, progress: Progress) -> Made:
    from flight import rehearse
    from ltlplan.output import write_rehearsal
    from verify.run_folder import proved_run

    progress("proving the certificate again", 0.0)
    run, seed = proved_run(folder / "run"), plain.get("seed")
    found = rehearse(
        run.plan, run.team, run.certificate, combinations=_combinations(plain), noise=plain.get("noise", "0.001"), runs=plain.get("runs", 20),
        seed=run.plan.seed if seed is None else seed, progress=part_of(progress, 0.1, 0.95),
    )  # fmt: skip
    with _written(folder) as made:
        write_rehearsal(run.plan, found, made)
        rows = [list(row) for row in found.rows()]
        return Made({"rows": rows, "sentences": list(found.sentences)}, _files(made))


def _recording(plain: Plain, folder: Path, sent: bytes, progress: Progress) -> Made:
    from ltlplan.service.views.recorded import judged_run

    said: dict[str, Any] = {  # of any type: the fields of `RecordingAsked`
        key: tuple(value) if isinstance(value, list) else value for key, value in plain["said"].items()
    }
    answer, shown = judged_run(folder, sent, RecordingAsked(**said), progress)
    written = [f"{key.replace('_', ' ')}: {_said(value)}" for key, value in plain["said"].items() if value]
    shown |= {"file": plain["name"], "said": written}
    told = {"outcome": answer["outcome"], "sentence": shown["sentence"], "words": shown["words"], "said": written}
    return Made(told, ((VERDICT, as_json(answer)), (SHOWN, as_json(shown)), (plain["name"], sent)))


_WORK: dict[str, Callable[[Plain, Path, bytes, Progress], Made]] = {
    "export": _export, "campaign": _campaign, "rehearsal": _rehearsal, "recording": _recording,
}  # fmt: skip
KINDS = frozenset(_WORK)


def _conditions(options: Plain) -> dict[str, Any]:
    return {name: value for name, value in options.items() if name not in ("runs", "seed")}


def _combinations(options: Plain) -> Combinations:
    from flight.rehearsal.combinations import USUAL, Combinations

    return Combinations(
        tuple(options["controllers"]) if options.get("controllers") else None,
        tuple(options.get("masses") or USUAL.masses),
        tuple(options.get("latencies") or USUAL.latencies),
        tuple(options.get("winds") or USUAL.winds),
        tuple(options.get("drags") or USUAL.drags),  # another word is rejected there
        options.get("corners", True),
        (),
        options.get("hunt"),
    )


@contextmanager
def _written(folder: Path) -> Generator[Path]:
    made = folder / "made"
    made.mkdir()
    yield made


def _files(folder: Path) -> Files:
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    return tuple((str(path.relative_to(folder)), path.read_bytes()) for path in paths)


def _said(value: object) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else json.dumps(value).strip('"')
