"""Where a small fault can be planted in the judge: comparisons, signs, operators, constants and conditions.

A draw orders all sites by a hash of what stands there (not of its line), so that a change elsewhere in the code leaves the
other faults of a draw as they were.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]

COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
OPERATORS: dict[type[ast.operator], tuple[type[ast.operator], ...]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.Pow: (ast.Mult,),
    ast.FloorDiv: (ast.Mult,),
    ast.Mod: (ast.Mult,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
}
OTHERS = {"min": "max", "max": "min", "any": "all", "all": "any"}


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault that can be planted.

    Attributes:
        path: File, relative to the repository.
        line: Line of the changed expression, from 1.
        function: Function or method that holds it, outermost; empty at the level of a module or class.
        before: The expression as it stands.
        after: The expression with the fault.
        same: How many equal expressions with the same fault stand before it in the same function.
        place: The how-manieth expression of the file it is, and the how-manieth change of that.
        wide: Whether statements and calls are changed as well, see `faults`.
    """

    path: str
    line: int
    function: str
    before: str
    after: str
    same: int
    place: tuple[int, int]
    wide: bool = False

    @property
    def name(self) -> str:
        """What tells this fault from others, whatever stands elsewhere in the file and wherever the file is."""
        number = f" #{self.same}" if self.same else ""
        return f"{self.function or Path(self.path).stem}: {self.before} -> {self.after}{number}"

    @property
    def module(self) -> str:
        """The module that holds it, as it is imported."""
        return self.path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


_Found = tuple[ast.expr | ast.stmt, str, bool, Callable[[ast.AST], None]]
"""An expression or statement, the function that holds it, whether it alone decides a branch, and how to put another in its place."""


def draw(count: int | None, seed: int, *places: str, wide: bool = False) -> list[Fault]:
    """Draw faults at random: the same ones for a seed wherever the code around them is the same.

    Strategies (`verify.testing.drawn_*`) are left out: they judge nothing, and what they draw may be other things as well.

    Args:
        count: How many; None for all.
        seed: Their order.
        places: Folders and modules; none for all of `verify`.
        wide: See `faults`.
    """
    given = [ROOT / place for place in places or ("verify",)]
    every = {path for place in given for path in ([place] if place.suffix else place.rglob("*.py"))}
    paths = [path for path in sorted(every) if not path.name.startswith("drawn_")]
    found = [fault for path in paths for fault in faults(path, wide=wide)]
    found.sort(key=lambda fault: (hashlib.sha256(f"{seed}:{fault.name}".encode()).digest(), fault.path))
    return found[:count]


def faults(path: Path, *, wide: bool = False) -> Iterator[Fault]:
    """Yield every fault that can be planted in a module.

    Args:
        path: The module.
        wide: Also leave statements out, swap arguments, lower constants, and take one of min and max, or any and all, for the other.
    """
    seen: dict[tuple[str, str, str], int] = {}
    for index, (node, function, decides, _) in enumerate(_sites(ast.parse(path.read_text()), wide)):
        before = ast.unparse(node)
        for number, changed in enumerate(_changed(node, decides, wide)):
            key = (function, before, ast.unparse(changed))
            seen[key] = seen.get(key, -1) + 1
            yield Fault(str(path.relative_to(ROOT)), node.lineno, *key, seen[key], (index, number), wide)


def plant(fault: Fault) -> ast.Module:
    """Return the fault's module with the fault in it, every line where it was."""
    tree = ast.parse((ROOT / fault.path).read_text())
    index, number = fault.place
    node, _, decides, put = list(_sites(tree, fault.wide))[index]
    put(ast.copy_location(list(_changed(node, decides, fault.wide))[number], node))
    return ast.fix_missing_locations(tree)


def _sites(tree: ast.Module, wide: bool) -> Iterator[_Found]:
    """Yield what may be changed; of zips whether they are strict is left out of wide draws: it never decides what is right."""
    lengths = {id(node.value) for node in ast.walk(tree) if wide and isinstance(node, ast.keyword) and node.arg == "strict"}
    for found in _expressions(tree, ""):
        if (wide or isinstance(found[0], ast.expr)) and id(found[0]) not in lengths:
            yield found


def _expressions(node: ast.AST, function: str, owner: str = "") -> Iterator[_Found]:
    """Walk a tree's expressions that decide something: no annotations, decorators, texts or errors' messages."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for index, child in enumerate(value if isinstance(value, list) else [value]):
            if not isinstance(child, ast.AST) or isinstance(child, ast.JoinedStr | ast.Raise | ast.ImportFrom):
                continue
            if isinstance(child, ast.ClassDef):
                yield from _expressions(child, function, f"{owner}{child.name}.")
                continue
            if isinstance(child, ast.arguments) and isinstance(node, ast.FunctionDef) and function == f"{owner}{node.name}":
                yield from _expressions(child, "", owner)  # defaults are made where the function is defined
                continue
            if isinstance(child, ast.FunctionDef):
                yield from _expressions(child, function or f"{owner}{child.name}", owner)
                continue
            texts = isinstance(child, ast.Expr) and isinstance(child.value, ast.Constant)
            if isinstance(child, ast.expr | ast.Expr | ast.AugAssign) and not texts:

                def put(changed: ast.AST, value: object = value, index: int = index, name: str = name) -> None:
                    if isinstance(value, list):
                        value[index] = changed
                    else:
                        setattr(node, name, changed)

                yield child, function, name in ("test", "ifs"), put
            yield from _expressions(child, function, owner)


def _changed(node: ast.expr | ast.stmt, decides: bool, wide: bool) -> Iterator[ast.expr | ast.stmt]:
    yield from _changes(node, decides) if isinstance(node, ast.expr) else ()
    if wide:
        yield from _wide_changes(node)


def _wide_changes(node: ast.expr | ast.stmt) -> Iterator[ast.expr | ast.stmt]:
    match node:
        case ast.Expr() | ast.AugAssign():
            yield ast.Pass()
        case ast.Call(ast.Name(name), arguments, keywords) if name in OTHERS:
            yield ast.Call(ast.Name(OTHERS[name], ast.Load()), arguments, keywords)
        case ast.Call(function, [first, second, *rest], keywords) if not any(
            isinstance(one, ast.Starred) for one in (first, second)
        ):
            yield ast.Call(function, [second, first, *rest], keywords)
        case ast.Constant(int() as value) if not isinstance(value, bool):
            yield ast.Constant(value - 1)
        case _:
            return


def _changes(node: ast.expr, decides: bool) -> Iterator[ast.expr]:
    if decides and isinstance(node, ast.Name | ast.Attribute | ast.Call | ast.Subscript):
        yield ast.UnaryOp(ast.Not(), node)
        return
    match node:
        case ast.Compare(left, [operator], [right]):
            for other in COMPARISONS[type(operator)]:
                yield ast.Compare(left, [other()], [right])
        case ast.Compare(left, operators, rights):
            for index, operator in enumerate(operators):
                other = COMPARISONS[type(operator)][0]()
                yield ast.Compare(left, [*operators[:index], other, *operators[index + 1 :]], rights)
        case ast.BinOp(left, operator, right) if type(operator) in OPERATORS and not _is_text(left):
            for other in OPERATORS[type(operator)]:
                yield ast.BinOp(left, other(), right)
        case ast.UnaryOp(ast.USub() | ast.Not(), operand):
            yield operand
        case ast.BoolOp(ast.And(), values):
            yield ast.BoolOp(ast.Or(), values)
        case ast.BoolOp(ast.Or(), values):
            yield ast.BoolOp(ast.And(), values)
        case ast.IfExp(test, body, other):
            yield ast.IfExp(test, other, body)
        case ast.Constant(bool() as value):
            yield ast.Constant(not value)
        case ast.Constant(int() as value):
            yield ast.Constant(value + 1)
        case ast.Constant(float() as value) if value:
            yield ast.Constant(value * 2)
        case _:
            return


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))
