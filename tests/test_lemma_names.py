"""The kernel's docstrings name lemmas that are proved, and the proofs name whose rules they are."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import verify.kernel
from tests.helpers.kernel.proved_checkers import PROOFS

NAMED = re.compile(r"Coq[^:`]*:\s+((?:`\w+`(?:,\s+|\s+and\s+)?)+)")
STATED = re.compile(r"^\s*(?:Theorem|Lemma|Corollary)\s+(\w+)", re.MULTILINE)
PRINTED = re.compile(r"^Print Assumptions (\w+)\.(\w+)\.(?: \(\* (.*) \*\))?$", re.MULTILINE)


def docstrings() -> Iterator[tuple[str, str]]:
    """Yield each docstring of the kernel with the name of its module, class or function."""
    for source in sorted(Path(verify.kernel.__file__).parent.glob("*.py")):
        for node in ast.walk(ast.parse(source.read_text())):
            if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and (text := ast.get_docstring(node)):
                yield getattr(node, "name", source.stem), text


def named_by_the_kernel() -> set[tuple[str, str]]:
    """Return pairs of a lemma and of whose docstring names it."""
    return {
        (lemma, owner)
        for owner, text in docstrings()
        for names in NAMED.findall(text)
        for lemma in re.findall(r"\w+", names.replace(" and ", " "))
    }


def test_each_theorem_whose_axioms_are_printed_is_stated() -> None:
    stated = {(file.stem, name) for file in PROOFS.glob("*.v") for name in STATED.findall(file.read_text())}
    printed = {(file, name) for file, name, _ in PRINTED.findall((PROOFS / "Axioms.v").read_text())}
    assert printed - stated == set()


def test_each_lemma_that_the_kernel_names_is_proved() -> None:
    printed = {lemma for _, lemma, _ in PRINTED.findall((PROOFS / "Axioms.v").read_text())}
    named = {lemma for lemma, _ in named_by_the_kernel()}
    assert named - printed == set()
    assert len(named) > 15


def test_each_mention_of_a_proof_is_understood() -> None:
    for owner, text in docstrings():
        assert len(re.findall(r"\bCoq\b", text)) == len(NAMED.findall(text)), owner
