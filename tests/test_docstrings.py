"""Public functions say what callers need: `Args:` from three arguments on, `Raises:` where their own body raises.

What raises further down is for the author to know and to say; only a function's own statements can be seen here. Parameters
that carry their help in their annotation, as a command's do, need no `Args:`.
"""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("ltlplan", "refine", "flight", "verify")

LACKING: dict[str, frozenset[str]] = {
    "ltlplan": frozenset({}),
    "refine": frozenset(),
    "flight": frozenset(),
    "verify": frozenset(),
}
"""What still lacks a section, as `module.function Section`; no other function may join it."""

HELPED = re.compile(r"\bAnnotated\[|(Option|Argument)$")
"""Annotations of a command's parameters, which hold their help."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def public_functions(tree: ast.Module | ast.ClassDef, inside: str = "") -> Iterator[tuple[str, Function]]:
    """Yield a module's public functions and its public classes' public methods, with their names."""
    for node in tree.body:
        if isinstance(node, Function | ast.ClassDef) and not node.name.startswith("_"):
            if isinstance(node, ast.ClassDef):
                yield from public_functions(node, f"{inside}{node.name}.")
            else:
                yield inside + node.name, node


def arguments(function: Function) -> list[ast.arg]:
    """Return a function's arguments but `self` and `cls`."""
    given = function.args
    every = [*given.posonlyargs, *given.args, given.vararg, *given.kwonlyargs, given.kwarg]
    return [each for each in every if each is not None and each.arg not in ("self", "cls")]


def raises(function: Function) -> bool:
    """Tell whether a function's own body raises; what is defined in it is somebody else's body."""
    todo: list[ast.AST] = list(function.body)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Raise):
            return True
        if not isinstance(node, Function | ast.ClassDef | ast.Lambda):
            todo += ast.iter_child_nodes(node)
    return False


def lacks(function: Function) -> Iterator[str]:
    """Yield the sections that a function's docstring needs and has not."""
    text = ast.get_docstring(function) or ""
    sections = {line.strip() for line in text.splitlines()}
    given = arguments(function)
    explained = [each for each in given if each.annotation and HELPED.search(ast.unparse(each.annotation))]
    if len(given) - len(explained) >= 3 and "Args:" not in sections:
        yield "Args"
    if "Raises:" not in sections and not explained and raises(function):
        yield "Raises"


def overloaded(function: Function) -> bool:
    """Tell whether this is one of several signatures only."""
    return any("overload" in ast.unparse(each) for each in function.decorator_list)


@functools.cache
def read(package: str) -> tuple[frozenset[str], dict[str, list[str]]]:
    """Return what lacks a section, as `module.function Section`, and what begins badly by the file; each file is parsed once."""
    result, begun = set[str](), dict[str, list[str]]()
    for path in sorted((ROOT / package).rglob("*.py")):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        begun[str(path.relative_to(ROOT))] = badly_begun(tree)
        parts = path.relative_to(ROOT).with_suffix("").parts
        if any(part.startswith("_") and part != "__init__" for part in parts):
            continue
        module = ".".join(part for part in parts if part != "__init__")
        for name, function in public_functions(tree):
            if not overloaded(function):
                missing = set(lacks(function))
                if name == "command" and module.startswith("ltlplan.commands."):
                    missing.discard("Args")  # each option says in --help what it is
                result |= {f"{module}.{name} {section}" for section in missing}
    return frozenset(result), begun


@pytest.mark.parametrize("package", PACKAGES)
def test_arguments_and_errors_are_said(package: str) -> None:
    assert sorted(read(package)[0] - LACKING[package]) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_what_is_said_by_now_is_off_the_list(package: str) -> None:
    assert sorted(LACKING[package] - read(package)[0]) == [], "take it off the list"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("def f(a, b): 'Do.'", []),
        ("def f(a, b, *, c): 'Do.'", ["Args"]),
        ("def f(a, *b, **c): 'Do.'", ["Args"]),
        ("def f(a, b, c):\n 'Do.\\n\\n Args:\\n  a: One.\\n'", []),
        ("def f(a: Annotated[int, help], b: Annotated[int, help], c): 'Do.'", []),
        ("def f(a: JsonOption, b: options.SeedOption, c: FolderArgument): 'Do.'", []),
        ("def f(self, a, b):\n 'Do.'\n if a:\n  raise ValueError", ["Raises"]),
        ("def f():\n 'Do.'\n def g():\n  raise ValueError", []),
        ("def f():\n 'Do.\\n\\n Raises:\\n  ValueError: Always.\\n'\n raise ValueError", []),
    ],
)
def test_sections_are_seen(text: str, wanted: list[str]) -> None:
    (function,) = ast.parse(text).body
    assert isinstance(function, ast.FunctionDef)
    assert list(lacks(function)) == wanted


CLAUSE = re.compile(r"(What|Whatever|Who|Whoever|Whose|Whom|How|Which|Whether|Where|When|Why|Nobody|Somebody|Everybody)\b")
"""Words that begin a clause, where a docstring begins with a verb or a noun."""


def docstrings(tree: ast.Module) -> Iterator[tuple[str, bool, str]]:
    """Yield the docstrings of a module, its classes and functions: name, whether it is a public function that is called, text."""
    todo: list[tuple[str, bool, ast.Module | ast.ClassDef | Function]] = [("", True, tree)]
    while todo:
        name, public, node = todo.pop()
        called = isinstance(node, Function) and not any("property" in ast.unparse(each) for each in node.decorator_list)
        yield name, called and public, ast.get_docstring(node) or ""
        inner = [each for each in node.body if isinstance(each, Function | ast.ClassDef)]
        hidden = isinstance(node, Function)
        todo += [(f"{name}.{each.name}", public and not hidden and not each.name.startswith("_"), each) for each in inner]


def badly_begun(tree: ast.Module) -> list[str]:
    """Return the names of what begins its docstring with a clause, or, of functions, with a noun."""
    return [
        name
        for name, called, docstring in docstrings(tree)
        if CLAUSE.match(docstring) or (called and re.match(r"(The|A|An|True|Number|That)\b", docstring))
    ]


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_begin_with_a_verb_or_a_noun(package: str) -> None:
    assert {path: names for path, names in read(package)[1].items() if names} == {}


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("'''What is here.'''", [""]),
        ("'''Rules.'''\nclass A:\n '''How it is.'''\n def f(self): 'The sum.'", [".A", ".A.f"]),
        ("class A:\n 'Sum.'\n @property\n def f(self): 'The sum.'\n @cached_property\n def g(self): 'Whether.'", [".A.g"]),
        ("def _f(): 'What it is.'\ndef g():\n 'Return what it is.'\n def h(): 'What.'", [".g.h", "._f"]),
        ("def _f(): 'The sum.'\ndef g():\n 'Return it.'\n def h(): 'A sum.'", []),
    ],
)
def test_bad_beginnings_are_seen(text: str, wanted: list[str]) -> None:
    assert badly_begun(ast.parse(text)) == wanted
