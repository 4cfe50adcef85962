"""The public calls have the types that they are said to have, and what must not be called so is an error."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent


@pytest.mark.slow
@pytest.mark.parametrize("name", ["right_calls.py", "wrong_calls.py"])
def test_pyright_sees_just_what_is_expected(name: str) -> None:
    program = shutil.which("pyright", path=str(Path(sys.executable).parent)) or shutil.which("pyright")
    if program is None:
        pytest.skip("needs pyright")
    done = subprocess.run(
        [program, "--pythonpath", sys.executable, str(HERE / name)],
        cwd=HERE.parents[1],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "0 errors" in done.stdout
