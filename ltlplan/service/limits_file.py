"""Limits of a service out of a file of its admin: YAML, the fields of `Limits` by their names."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any

from ltlplan.service.settings import Limits, Rate
from verify.data.errors import BadInput, did_you_mean
from verify.data.storage.safe_reading import read_text

_MOST = 100_000


def read_limits(path: Path) -> Limits:
    """Return the limits that a file says; what it leaves out is as usual.

    Args:
        path: YAML such as `stage_seconds: 7200`; of a rate `reads: {per_second: 100, burst: 1000}`.

    Raises:
        BadInput: It cannot be read, or says what no limit is.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    text = read_text(path, most=_MOST, what="file of limits")
    try:
        data = YAML(typ="safe", pure=True).load(text)
    except (YAMLError, ValueError, RecursionError) as error:
        raise BadInput(f"{path} is no YAML: {' '.join(str(error).split())[:200]}") from None
    if data is None:
        return Limits()
    if not isinstance(data, dict):
        raise BadInput(f"{path} is no table of limits such as `stage_seconds: 7200`.")
    usual = {field.name: getattr(Limits(), field.name) for field in dataclasses.fields(Limits)}
    unknown = [str(name) for name in data if name not in usual]
    if unknown:
        raise BadInput(
            f"{path}: '{unknown[0][:60]}' is no limit.{did_you_mean(unknown[0], list(usual))} docs/service.md lists them."
        )
    given: dict[str, Any] = {
        name: _limit(f"{path}: {name}", value, usual[name]) for name, value in data.items()
    }  # of the kinds that the fields have
    return Limits(**given)


def limits_told(limits: Limits) -> dict[str, Any]:
    """Return limits as plain data, as they are told to those whom they meet."""
    return dataclasses.asdict(limits)


def _limit(where: str, value: object, usual: float | Rate) -> float | Rate:
    """Return a limit of the kind that the usual one is.

    Raises:
        BadInput: It is another.
    """
    if isinstance(usual, Rate):
        if not isinstance(value, dict) or value.keys() != {"per_second", "burst"}:
            raise BadInput(f"{where} is a rate, such as {{per_second: {usual.per_second:g}, burst: {usual.burst}}}.")
        burst = _limit(f"{where}.burst", value["burst"], usual.burst)
        per_second = _limit(f"{where}.per_second", value["per_second"], usual.per_second)
        assert isinstance(burst, int)
        assert isinstance(per_second, float)
        return Rate(per_second, burst)
    whole = isinstance(usual, int)
    if isinstance(value, bool) or not isinstance(value, int if whole else int | float) or not 0 < value < math.inf:
        raise BadInput(f"{where} is {'a whole number' if whole else 'a number'} above 0, such as {usual:g}, not {value!r:.60}.")
    return value if whole else float(value)
