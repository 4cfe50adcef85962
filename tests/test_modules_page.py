"""docs/modules.md lists every module with its first sentence; `python -m tests.test_modules_page` writes it anew."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "modules.md"
PACKAGES = {
    "ltlplan": "the front door: planning, the pipeline, the command line, the report",
    "refine": "from waypoints to polynomials",
    "flight": "simulation, control, monitor, export, pictures",
    "verify": "the judge, and the plain data that everyone shares",
}


def first_sentence(path: Path) -> str:
    """Return a module's first sentence, on one line."""
    docstring = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))
    assert docstring, f"{path.relative_to(ROOT)} has no docstring"
    paragraph = " ".join(docstring.split("\n\n")[0].split())
    return re.split(r"(?<=[a-z)`\]0-9])\. (?=[A-Z`(])", paragraph)[0].rstrip(".").replace("|", "\\|")


def page() -> str:
    parts = [
        "# Modules",
        "",
        "Every module with its first sentence; the [architecture](architecture.md) says how they hang together.",
    ]
    for package, what in PACKAGES.items():
        parts += ["", f"## {package}: {what}", "", "| module | what |", "|---|---|"]
        for path in sorted((ROOT / package).rglob("*.py")):
            name = str(path.relative_to(ROOT / package)).removesuffix(".py").removesuffix("/__init__").replace("/", ".")
            if name != "__init__":
                parts.append(f"| `{name}` | {first_sentence(path)} |")
    return "\n".join(parts) + "\n"


def test_the_page_lists_every_module_as_it_describes_itself() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "write it anew: python -m tests.test_modules_page"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
