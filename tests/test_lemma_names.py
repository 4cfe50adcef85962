"""The kernel's docstrings name lemmas that are proved, and the proofs name whose rules they are."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import verify.kernel
from tests.helpers.proved_checkers import PROOFS

NAMED = re.compile(r"Coq[^:`]*:\s+((?:`\w+`(?:,\s+|\s+and\s+)?)+)")
STATED = re.compile(r"^\s*(?:Theorem|Lemma|Corollary)\s+(\w+)", re.MULTILINE)
PRINTED = re.compile(r"^  (\w+)\.(\w+)(?:,|\)\.)(?: \(\* (.*) \*\))?$", re.MULTILINE)


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


def named_by_the_proofs() -> set[tuple[str, str]]:
    """Return pairs of a lemma and of a module, class or function of the kernel that `Axioms.v` says rests on it."""
    text = (PROOFS / "Axioms.v").read_text()
    return {(lemma, owner) for _, lemma, owners in PRINTED.findall(text) for owner in owners.split(", ") if owner}


def test_each_theorem_whose_axioms_are_printed_is_stated() -> None:
    stated = {(file.stem, name) for file in PROOFS.glob("*.v") for name in STATED.findall(file.read_text())}
    printed = {(file, name) for file, name, _ in PRINTED.findall((PROOFS / "Axioms.v").read_text())}
    assert printed - stated == set()


def test_kernel_and_proofs_name_each_other() -> None:
    assert named_by_the_kernel() == named_by_the_proofs()
    assert len(named_by_the_kernel()) > 40


def test_each_mention_of_a_proof_is_understood() -> None:
    for owner, text in docstrings():
        assert len(re.findall(r"\bCoq\b", text)) == len(NAMED.findall(text)), owner
