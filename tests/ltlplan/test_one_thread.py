"""Commands compute in one thread, unless their user asks for more."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from ltlplan.start import THREADS, compute_in_one_thread


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ({}, ("1", "1", "1")),
        ({"OMP_NUM_THREADS": "4"}, ("4", "4", "4")),
        ({"OPENBLAS_NUM_THREADS": "2"}, ("1", "2", "1")),
        ({"OMP_NUM_THREADS": "4", "MKL_NUM_THREADS": "3"}, ("4", "4", "3")),
    ],
)
def test_the_users_own_numbers_of_threads_stand(
    given: dict[str, str], wanted: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in THREADS:
        monkeypatch.delenv(name, raising=False)
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(os, "environ", {**os.environ})
    compute_in_one_thread()
    assert tuple(os.environ[name] for name in THREADS) == wanted


def test_what_computes_is_loaded_after_that() -> None:
    asked = "import sys, ltlplan.start; print([name for name in ('numpy', 'scipy', 'casadi', 'spot') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
