"""Coq's proofs built in a folder of their own, the axioms that they print, and the extracted checkers as a process."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from tests.helpers.kernel.proof_rules import Invariant, Move, Span, Team, normal

Condition = tuple[list[int], list[int]]
Region = tuple[list[list[int]], list[list[int]], list[Condition]]
"""Parts and choices, each by numbers of conditions; of each condition what is not negative where it is kept, and positive where broken."""
PROOFS = Path(__file__).parents[3] / "proofs"
REALS = {
    "ClassicalDedekindReals.sig_forall_dec",
    "ClassicalDedekindReals.sig_not_dec",
    "FunctionalExtensionality.functional_extensionality_dep",
}
"""The axioms of Coq's real numbers."""


def build_proofs(folder: Path) -> dict[str, set[str]]:
    """Build all proofs in a copy, and return the axioms of each theorem that `Axioms.v` prints."""
    shutil.copytree(PROOFS, folder, ignore=shutil.ignore_patterns("*.vo*", "*.glob", ".*", "*CoqMakefile*"))
    project = (folder / "_CoqProject").read_text().split()
    printed = ""
    for name in (name for name in project if name.endswith(".v")):
        done = _run(["coqc", *project[:3], name], folder)
        if name == "Axioms.v":
            printed = done
    theorems = re.findall(r"^Print Assumptions (\S+)\.$", (folder / "Axioms.v").read_text(), re.MULTILINE)
    blocks = re.split(r"^(?=Axioms:|Closed under the global context)", printed, flags=re.MULTILINE)[1:]
    assert len(blocks) == len(theorems)
    return {
        theorem: set(re.findall(r"^([A-Z][\w.]*)(?= :|$)", block, re.MULTILINE)) - {"Closed"}
        for theorem, block in zip(theorems, blocks, strict=True)
    }


def build_checkers(folder: Path) -> Path:
    """Compile what was extracted there with its driver."""
    _run(["ocamlfind", "ocamlopt", "checkers.mli", "checkers.ml", "driver.ml", "-o", "checkers"], folder)
    return folder / "checkers"


def ask(checkers: Path, cases: Iterable[str]) -> list[str]:
    """Return the extracted checkers' verdict on each case."""
    done = subprocess.run([str(checkers)], input="\n".join(cases), capture_output=True, text=True, check=True, timeout=600)
    return done.stdout.splitlines()


def _run(command: list[str], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout


# How `driver.ml` reads cases


def listed(items: Iterable[Any], show: Callable[[Any], str] = str) -> str:
    shown = [show(item) for item in items]
    return " ".join([str(len(shown)), *shown])


def numbers(items: Iterable[int]) -> str:
    return listed(items)


def hexadecimal(items: Iterable[int]) -> str:
    return listed(items, "{:x}".format)


def formula(parts: tuple[Any, ...]) -> str:
    return " ".join(formula(part) if isinstance(part, tuple) else str(part) for part in parts)


def tree_case(region: Region, marks: Sequence[str]) -> str:
    parts, choices, conditions = region
    rows = listed(conditions, lambda one: f"{hexadecimal(one[0])} {hexadecimal(one[1])}")
    return f"tree {listed(parts, numbers)} {listed(choices, numbers)} {rows} {listed(marks)}"


def word_case(spec: tuple[Any, ...], word: Iterable[Iterable[int]]) -> str:
    return f"word {formula(spec)} {listed(word, lambda letter: numbers(sorted(letter)))}"


def letters(items: Iterable[Iterable[int]]) -> str:
    return listed(items, lambda letter: numbers(sorted(letter)))


def team_case(team: Team, spec: Any, places: list[tuple[int, ...]], spans: list[Span], invariant: Invariant) -> str:
    def entry(one: Any) -> str:
        at, alternative = one
        return f"{listed(at, lambda x: f'{x[0]} {int(x[1])}') if team.own else numbers(at)} {listed(alternative, formula)}"

    return " ".join(
        [
            "own" if team.own else "joint",
            listed(team.robots, lambda one: f"{letters(one[0])} {listed(one[1], lambda c: f'{c[0]} {c[1]}')}"),
            formula(spec),
            *([] if team.own else [letters(spans[0].others)]),
            listed(places, numbers),
            listed(team.last, numbers),
            listed(spans, lambda span: f"{listed(span.places, numbers)} {letters(span.others)}"),
            listed(invariant, lambda entries: listed(entries, entry)),
        ]
    )


def system_case(team: Team, spec: Any, starts: list[Move], spans: list[Span], invariant: Invariant) -> str:
    """Write a team's moves out, of all states that the invariant names."""

    def state(at: Any) -> str:
        return listed(at, lambda x: f"{x[0]} {int(x[1])}" if team.own else f"{x} 0")

    def move(one: Move) -> str:
        letter, at = one
        return f"{'-' if letter is None else f'+ {numbers(sorted(letter))}'} {state(at)}"

    def table(states: list[Any], moves: Callable[[Any], list[Move]]) -> str:
        return listed(states, lambda at: f"{state(at)} {listed(moves(at), move)}")

    def span(number: int) -> str:
        here = list(dict.fromkeys(at for at, _ in invariant[number])) if number < len(invariant) else []
        before = list(dict.fromkeys(at for at, _ in invariant[number - 1])) if 0 < number <= len(invariant) else []
        moves = table(here, lambda at: team.moves(spans[number], at))
        return f"{moves} {table(before, lambda at: team.enters(spans[number], at))}"

    ended = list(dict.fromkeys(at for entries in invariant for at, _ in entries if team.final(at)))
    return " ".join(
        [
            "system",
            formula(normal(spec, False)),
            listed(starts, move),
            listed(range(len(spans)), span),
            listed(ended, state),
            listed(invariant, lambda entries: listed(entries, lambda one: f"{state(one[0])} {listed(one[1], formula)}")),
        ]
    )
