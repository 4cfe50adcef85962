"""Questions that are answered at once, each in a process of its own (`asking`).

They take plain values and paths that the service itself has chosen, and return bytes that are ready to be sent, so that the serving
process has nothing to compute.
"""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ltlplan.service.models import ProblemFault
from ltlplan.service.problems import NotFound, faults_of
from ltlplan.service.recordings import RecordingAsked, put_recording
from ltlplan.service.study_models import Varied
from verify.data import BadInput, LtlplanError, Mission, MissionError, parse_mission
from verify.data.progress import Progress

if TYPE_CHECKING:
    from verify.data.sections import TeamReading

Words = list[str] | dict[str, str]
Place = tuple[tuple[str, str], ...]
"""Files by name: where their bytes lie."""

_AT = (1980, 1, 1, 0, 0, 0)
"""The time in archives, so that the same files make the same bytes."""


def as_json(data: object) -> bytes:
    """Return plain data as JSON."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).encode("utf-8", "backslashreplace")


def check_mission(text: str, report: Progress) -> bytes:
    """Check a mission as it is typed: every fault with its line and keys, or what it asks, in words.

    Args:
        text: YAML or JSON.
        report: Receives nothing.
    """
    del report
    from ltlplan.missions.notes import notes_of
    from ltlplan.service.views.formulas import in_words

    try:
        mission = parse_mission(text)
    except MissionError as error:
        return as_json({"sound": False, "faults": _plain(faults_of(error, text)), **_read_nothing()})
    except BadInput as error:
        return as_json(
            {"sound": False, "faults": [{"line": 1, "column": 1, "keys": [], "message": str(error)}], **_read_nothing()}
        )
    told: dict[str, Any] = {
        "name": mission.name,
        "formula": mission.spec.formula,
        "sequence": mission.sequence,
        "trace": mission.spec.trace,
        "sentences": list(in_words(mission)),
        "notes": list(notes_of(mission)),
        "robots": list(mission.agents),
        "propositions": sorted(mission.propositions),
        "digest": mission.digest(),
    }
    return as_json({"sound": True, "faults": [], **told})


def _read_nothing() -> dict[str, Any]:
    names = ("name", "formula", "sequence", "trace", "digest")
    return {**dict.fromkeys(names), "sentences": [], "notes": [], "robots": [], "propositions": []}


def _plain(faults: tuple[ProblemFault, ...]) -> list[dict[str, Any]]:
    return [fault.model_dump(mode="json") for fault in faults]


def read_mission(text: str, report: Progress) -> Mission:
    """Return the mission of a text.

    Args:
        text: YAML or JSON.
        report: Receives nothing.
    """
    del report
    return parse_mission(text)


def varied_missions(text: str, key: str, values: tuple[Varied, ...], report: Progress) -> list[Mission]:
    """Return a mission once for each value of one of its keys.

    Args:
        text: YAML or JSON.
        key: Key with its sections, such as `limits.speed`.
        values: The values.
        report: Receives nothing.

    Raises:
        MissionError: All faults of the text, or with the first value that makes some; that value is named.
        BadInput: The key can have no value there.
    """
    del report
    from verify.data.files.mission_tree import read_tree

    data, found = read_tree(text, "mission").data, list[Mission]()
    for value in values:
        written = json.dumps(_with_value(data, key.split("."), value), default=str)
        try:
            found.append(parse_mission(written, f"{key} = {json.dumps(value)}"[:200]))
        except MissionError as error:
            unplaced = [replace(fault, line=None) for fault in error.faults]
            raise MissionError(error.source, unplaced) from None
    return found


def _with_value(data: Any, steps: Sequence[str], value: Varied) -> Any:  # of any type: YAML nests
    """Return plain data with another value at a key; sections that are not there are made.

    Raises:
        BadInput: There is no place for it.
    """
    if not steps:
        return value
    first, *rest = steps
    if isinstance(data, list) and first.isdecimal() and int(first) < len(data):
        at = int(first)
        return [*data[:at], _with_value(data[at], rest, value), *data[at + 1 :]]
    if not isinstance(data, dict):
        raise BadInput(f"The mission has no key '{first[:60]}' there: it stands in what is no section.")
    return {**data, first: _with_value(data.get(first, {}), rest, value)}


def mission_difference(first: str, second: str, report: Progress) -> str:
    """Return what changed from one mission to another, as a unified diff.

    Args:
        first: YAML.
        second: YAML.
        report: Receives nothing.
    """
    del report
    import difflib

    before, after = ([f"{line}\n" for line in text.splitlines()] for text in (first, second))
    return "".join(difflib.unified_diff(before, after, "first", "second", n=1))


def shipped_missions(report: Progress) -> bytes:
    """Return the shipped missions with their texts.

    Args:
        report: Receives nothing.
    """
    del report
    from ltlplan import missions

    listed: list[dict[str, Any]] = []
    for name in missions.shipped_missions():
        mission = missions.load_mission(name)
        asks = mission.spec.formula or mission.sequence or ""
        told = {"name": name, "robots": len(mission.agents), "trace": mission.spec.trace, "asks": asks}
        listed.append({**told, "text": missions.shipped_mission_text(name)})
    return as_json(listed)


def check_words(formula: str, words: Words, reading: TeamReading, report: Progress) -> bytes:
    """Hold a word, or the words of a team, against a formula.

    Args:
        formula: LTL in Spot's syntax.
        words: In Spot's notation; of a team by robot, or in order.
        reading: Team letters: each robot's own, or the union of all.
        report: Receives nothing.

    Raises:
        BadInput: A word or the formula cannot be read, or there is no word.
    """
    del report
    from verify.trace_checking.team_verdict import check_team
    from verify.trace_checking.word_verdict import check_word, parse_word

    named = words if isinstance(words, dict) else {f"quad{i}": word for i, word in enumerate(words)}
    given = {name: parse_word(word) for name, word in named.items()}
    if not given:
        raise BadInput("words must hold at least one word, such as 'a; b & c'.")
    if isinstance(words, list) and len(given) == 1:
        (word,) = given.values()
        verdicts = {"word": check_word(formula, word)}
    else:
        team = check_team(formula, given, reading)
        verdicts = {"sequential": team.sequential, "parallel": team.parallel}
    told = {name: verdict.to_dict() for name, verdict in verdicts.items()}
    return as_json({"formula": formula, "words": {name: str(word) for name, word in given.items()}, **told})


def _put(files: Place, folder: Path) -> None:
    for name, source in files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / name)


def archive(files: Place, report: Progress) -> bytes:
    """Return files as one ZIP archive.

    Args:
        files: What goes in.
        report: Receives nothing.
    """
    del report
    return zipped({name: Path(source).read_bytes() for name, source in files})


def zipped(files: Mapping[str, bytes]) -> bytes:
    """Return files as one ZIP archive; the same files make the same bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as packed:
        for name, data in sorted(files.items()):
            entry = zipfile.ZipInfo(name, _AT)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            packed.writestr(entry, data)
    return buffer.getvalue()


def recheck(folder: Path, files: Place, report: Progress) -> bytes:
    """Prove a job's certificate again, from its files alone, and return it.

    Args:
        folder: Empty, for use meanwhile.
        files: What the job has made.
        report: Receives nothing.
    """
    del report
    from verify import recheck as prove_again

    _put(files, folder)
    with without_places(folder):
        return prove_again(folder).to_json().encode()


def judge_flight(
    folder: Path,
    files: Place | dict[str, bytes],
    recording: bytes,
    said: RecordingAsked,
    report: Progress,
) -> bytes:
    """Check a recorded flight, claim by claim.

    Args:
        folder: Empty, for use meanwhile.
        files: What it was to do: files of a job, or as they were sent.
        recording: The recorded flight.
        said: What is said of it.
        report: Receives what is done.

    Raises:
        NotCertified: The flight's certificate is not proved any more.
        BadInput: A file is missing or unreadable, or the recording cannot be checked.
    """
    from ltlplan.recorded import judge_flight as judged_of
    from ltlplan.recording_options import told_of

    told = told_of(said.start, said.start_error, said.called, said.axes, said.origin)
    asked = folder / "run"
    asked.mkdir()
    if isinstance(files, dict):
        for name, data in _fitting(files).items():
            (asked / name).write_bytes(data)
    else:
        _put(files, asked)
    flown = put_recording(folder, recording)
    with without_places(folder):
        judged = judged_of(
            asked, flown, max_speed=said.max_speed, error=said.error, told=told, pauses=said.pauses, progress=report
        )
    return as_json({"mission": judged.mission, **judged.verdict.to_dict()})


def _fitting(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files that a run's folder has, by the names that it gives them; none of a name that a request made up."""
    from verify.data.events import EVENTS_FILE
    from verify.data.plan import PLAN_FILE
    from verify.data.storage.safe_reading import decoded
    from verify.run_folder import CERTIFICATE_FILE, MISSION_FILE

    if MISSION_FILE not in files:
        raise NotFound(f"Of the files, {MISSION_FILE} is needed: it holds the flight's mission.")
    mission = parse_mission(decoded(files[MISSION_FILE], MISSION_FILE, "mission file"), MISSION_FILE, installed=False)
    known = (MISSION_FILE, PLAN_FILE, CERTIFICATE_FILE, EVENTS_FILE, *(f"{robot}.csv" for robot in mission.agents))
    return {name: files[name] for name in known if name in files}


@contextmanager
def without_places(folder: Path) -> Generator[None]:
    """Let errors not say where on this machine files were meanwhile.

    Args:
        folder: Where they were.

    Raises:
        LtlplanError: What was raised within, without the folder's name.
    """
    try:
        yield
    except LtlplanError as error:
        error.args = (str(error).replace(f"{folder}/run/", "").replace(f"{folder}/", "").replace(str(folder), "The job"),)
        raise


def export_formats(report: Progress) -> bytes:
    """Return what flights can be written for, other packages' targets too.

    Args:
        report: Receives nothing.
    """
    del report
    from flight.exports.target import EXPORT_TARGETS

    found = map(EXPORT_TARGETS.find, EXPORT_TARGETS.names())
    return as_json(
        [
            {
                "name": each.name,
                "options": dict(each.options),
                "voids": list(each.voids),
                "controllers": list(each.controllers),
            }
            for each in found
        ]
    )
