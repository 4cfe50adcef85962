"""certificate.json as plain data: read with the shape that it must have, and compared with what is proved now."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from verify.certificate import CERTIFICATE_FORMAT, KERNEL_KEYS, payload_digest
from verify.claims.claim import ProofWord
from verify.data.errors import BadInput
from verify.data.storage.safe_reading import parse_json, read_bytes

MAX_BYTES = 20_000_000

_AGREE = 1e-6
"""Bounds proved on another machine may differ by so much of their size: sums are rounded in another order there."""


def read_certificate(path: Path, *, earlier: bool = False) -> dict[str, Any]:  # of any type: JSON nests
    """Read certificate.json as plain data of the right shape; `recheck` proves what it says.

    Args:
        path: The file.
        earlier: Whether earlier formats are read too. They have the same shape, but their sentences are not those that are proved now:
            only for folders that are certified again.

    Raises:
        BadInput: The file is unreadable, no certificate, or one of another format.
    """
    if not path.exists():
        raise BadInput(f"{path.parent} has no {path.name}; name a folder that `ltlplan run` or `ltlplan certify` wrote.")
    data = read_bytes(path, most=MAX_BYTES, what="certificate")
    return certificate_from_json(data, str(path), earlier=earlier)


def certificate_from_json(
    data: str | bytes, source: str = "certificate.json", *, earlier: bool = False
) -> dict[str, Any]:  # of any type: JSON nests
    """Read certificate.json as plain data; `recheck` proves what it says.

    Args:
        data: The file's contents.
        source: Names the file in messages.
        earlier: Whether earlier formats are read too, as in `read_certificate`.

    Raises:
        BadInput: It is no certificate, or one of another format.
    """
    value = parse_json(data, source)
    if not isinstance(value, dict):
        raise BadInput(f"{source} is no certificate: it must be an object.")
    _require_format(value.get("format"), source, earlier=earlier)
    for key, test, wanted in _SHAPE:
        if key not in value:
            raise BadInput(f"{source} lacks '{key}'; it is incomplete.")
        if not test(value[key]):
            raise BadInput(f"{source}: '{key}' must be {wanted}.")
    if "soft" in value and not _is_list_of_objects(value["soft"]):
        raise BadInput(f"{source}: 'soft' must be a list of objects.")
    kernel = value.get("kernel")  # certificates of before have none
    if kernel is not None and not _is_index(kernel):
        raise BadInput(f"{source}: 'kernel' must be the kernel's version, or null.")
    if value.get("tube", "assumed") not in ("assumed", "proved"):  # certificates of before say nothing
        raise BadInput(f'{source}: \'tube\' must be "assumed" or "proved".')
    unknown = sorted(set(value) - {key for key, _, _ in _SHAPE} - {"format", "kernel", "soft", "tube"})
    if unknown:
        raise BadInput(f"{source} has an unknown key '{unknown[0][:40]}'.")
    return value


def _require_format(number: Any, source: str, *, earlier: bool) -> None:
    if isinstance(number, bool) or not isinstance(number, int) or number < 1:
        raise BadInput(f'{source} must have "format": {CERTIFICATE_FORMAT}, not {number!r}.')
    if number > CERTIFICATE_FORMAT:
        raise BadInput(
            f"{source} has format {number}, which is later than this version's {CERTIFICATE_FORMAT}; update ltlplan."
        )
    if number < CERTIFICATE_FORMAT and not earlier:
        raise BadInput(
            f"{source} has format {number}: it was made by an earlier version of ltlplan, whose sentences can mean something else; "
            f"certify the folder again (`ltlplan certify`), which writes format {CERTIFICATE_FORMAT}."
        )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 <= value <= 1e300


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _are_trajectories(value: Any) -> bool:
    return isinstance(value, dict) and all(
        isinstance(entry, dict)
        and {"digest", "cycle"} <= set(entry) <= {"digest", "cycle", "cuts"}
        and _is_text(entry["digest"])
        and (entry["cycle"] is None or _is_index(entry["cycle"]))
        and ("cuts" not in entry or (isinstance(entry["cuts"], list) and all(map(_is_index, entry["cuts"]))))
        for entry in value.values()
    )


def _is_index(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_list_of_objects(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, dict) for item in value)


def _are_actions(value: Any) -> bool:
    return _is_list_of_objects(value) and all(
        set(item) == {"robot", "visit", "time", "source", "target"}
        and all(_is_text(item[key]) for key in ("robot", "source", "target"))
        and _is_number(item["time"])
        and _is_number(item["visit"])
        for item in value
    )


def _are_versions(value: Any) -> bool:
    return isinstance(value, dict) and all(map(_is_text, value.values()))


_SHAPE = (
    ("mission", _is_text, "a digest"),
    ("plan", _is_text, "a digest"),
    ("trajectories", _are_trajectories, "an object of digest, cycle and cuts for each robot"),
    ("margin", _is_number, "a number, at least 0"),
    ("largest_margin", lambda v: v is None or _is_number(v), "a number, at least 0, or null"),
    ("clock_error", _is_number, "a number, at least 0"),
    ("duration", _is_number, "a number, at least 0"),
    ("claims", _is_list_of_objects, "a list of objects"),
    ("actions", _are_actions, "a list of objects with robot, visit, time, source and target"),
    ("versions", _are_versions, "an object of texts"),
    ("digest", _is_text, "a digest"),
)


def difference(written: Mapping[str, Any], proved: Mapping[str, Any]) -> str:  # of any type: JSON nests
    """Say where certificate.json differs from what was proved now; versions may. Empty where it does not.

    Args:
        written: As it was read.
        proved: As it is proved now.
    """
    if written.get("tube", proved["tube"]) != proved["tube"]:
        return "its 'tube' is not what its claims give."
    for key in ("duration", "largest_margin", "actions"):
        if not _agree(written[key], proved[key]):
            return f"its '{key}' is not what the files give."
    for what, name in (("claims", "name"), ("soft", "formula")):
        ours, theirs = proved.get(what, []), written.get(what, [])
        if len(theirs) != len(ours):
            return f"it lists {len(theirs)} {'claims' if what == 'claims' else 'soft parts'}; the files give {len(ours)}."
        for index, (old, new) in enumerate(zip(theirs, ours, strict=True)):
            where = f"{'claim' if what == 'claims' else 'soft part'} {index} ({new[name]})"
            fault = _differing(old, new)
            if not fault and what == "claims" and proved["kernel"] is not None:  # without a proof the kernel says nothing
                fault = _unborne(old, new)
            if fault:
                return f"{where}: {fault}"
    if payload_digest(written) != written["digest"]:
        return "its digest does not belong to its contents."
    return ""


def _differing(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """Say in what a claim as it is written differs from the one that is proved."""
    for key in sorted((set(old) | set(new)) - set(KERNEL_KEYS)):
        if key == "sentence" and isinstance(old.get(key), str) and not _same_sentence(old[key], new[key]):
            return f"its sentence is not the one that is proved: {new[key]}"
        if key == "sentence":
            continue
        if key not in old or key not in new or not _agree(old[key], new[key]):
            return f"its '{key}' is not what the files give."
    return ""


def _unborne(old: Mapping[str, Any], new: Mapping[str, Any]) -> str:
    """Say why the kernel's word on a claim does not stand as it is written. What is checked now need not have been checked then."""
    if old.get("proof", "judged") not in get_args(ProofWord):
        return f"its 'proof' must be one of {', '.join(get_args(ProofWord))}."
    if old.get("proof") == "checked" and new["proof"] != "checked":
        return f"its 'proof' is 'checked', and the kernel does not check it: {new.get('missing', 'it is refuted')}."
    return ""


_NUMBER = re.compile(r"\d+(?:\.(\d+))?(?:e([+-]\d+))?")


def _same_sentence(old: str, new: str) -> bool:
    """Return whether two sentences are the same, last places of their numbers aside: on other machines they round otherwise."""
    if old == new:
        return True
    if len(old) > 10 * len(new) + 1000 or _NUMBER.sub("0", old) != _NUMBER.sub("0", new):
        return False
    for a, b in zip(_NUMBER.finditer(old), _NUMBER.finditer(new), strict=True):
        if a.group() == b.group():
            continue
        if a.group(1) is None or b.group(1) is None or len(a.group()) > 40:  # whole numbers count and name
            return False
        place = 10.0 ** (int(b.group(2) or 0) - min(len(a.group(1)), len(b.group(1))))
        if abs(float(a.group()) - float(b.group())) > 1.01 * place:
            return False
    return True


def _agree(a: Any, b: Any) -> bool:
    if isinstance(a, bool) or isinstance(b, bool) or not isinstance(a, int | float) or not isinstance(b, int | float):
        if isinstance(a, list) and isinstance(b, list):
            return len(a) == len(b) and all(map(_agree, a, b))
        if isinstance(a, dict) and isinstance(b, dict):
            return a.keys() == b.keys() and all(_agree(a[key], b[key]) for key in a)
        return type(a) is type(b) and a == b
    return abs(a) <= 1e300 and abs(b) <= 1e300 and math.isclose(a, b, rel_tol=_AGREE, abs_tol=_AGREE)
