"""The kernel is small, uses nothing but Python, and runs by itself."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

import verify.kernel
from tests.helpers.kernel.proofs import tables
from tests.helpers.motion.small_flights import small_flight
from tests.mutation.sites import ROOT
from verify import judge
from verify.proofs.finder import prove

FOLDER = Path(verify.kernel.__file__).parent
SOURCES = sorted(FOLDER.glob("*.py"))


def test_it_imports_nothing_but_the_standard_library():
    for source in SOURCES:
        for node in ast.walk(ast.parse(source.read_text())):
            if isinstance(node, ast.Import):
                names = [name.name for name in node.names]
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            else:
                continue
            assert all(name.split(".")[0] in sys.stdlib_module_names for name in names), (source.name, names)


def test_it_can_be_read_in_an_afternoon():
    lines = sum(len(source.read_text().splitlines()) for source in SOURCES)
    assert lines <= 2500
    for page in ("docs/certificate-meaning.md", "README.md"):
        assert f"{lines:,} lines".replace(",", " ") in (ROOT / page).read_text()


def test_it_has_no_plugins_and_runs_no_text():
    for source in SOURCES:
        names = {node.id for node in ast.walk(ast.parse(source.read_text())) if isinstance(node, ast.Name)}
        assert names.isdisjoint({"eval", "exec", "compile", "__import__", "globals"}), source.name


def test_the_archive_checks_a_folder_by_itself(shipped_folder):
    folder = shipped_folder("firefighting")
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(folder / "check.pyz"), str(folder)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1] == "49 of 49 claims checked by the kernel"
    for what in (
        "within 0.05 m",
        "region water",
        "opening: 0.25\n",
        "speed: 1\n",
        "starts at: (1, 0.5, 0.8)\n",
        "smoke -> carrying",
    ):
        assert what in done.stdout, what


def test_the_archive_refuses_a_folder_without_a_proof(tmp_path, shipped_folder):
    archive = shipped_folder("firefighting") / "check.pyz"
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(archive), str(tmp_path)], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 2
    assert done.stdout.startswith("refused: ")


@pytest.mark.parametrize(("change", "code"), [({}, 0), ({"margin": 0.2}, 1), ({"margin": -1}, 2)])
def test_the_module_says_by_its_exit_code_what_is_checked(tmp_path, change, code):
    """All claims, not all, or nothing that can be read."""
    plan, team = small_flight("one")
    proof = prove(plan, team, judge(plan, team, largest=False))
    statement = {**json.loads(proof.statement), **change}
    for name, text in {"statement.json": json.dumps(statement), "proof.json": proof.evidence}.items():
        (tmp_path / name).write_text(text)
    for name, text in tables(plan, team).items():
        (tmp_path / f"{name}.csv").write_text(text)
    command = [sys.executable, "-m", "verify.kernel", str(tmp_path)]
    done = subprocess.run(command, cwd=FOLDER.parents[1], capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (code, "")
    assert done.stdout.startswith("refused: " if code == 2 else "Kernel ")
