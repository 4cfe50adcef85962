"""A study is begun where a mission is written: which key is varied, over which values."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nicegui import ui

from ltlplan.service.page.elements import Words, box, button, say, submitted
from verify.data import BadInput, LtlplanError

if TYPE_CHECKING:
    from ltlplan.service.page.session_state import Desk
    from ltlplan.service.study_models import Varied

_KEYS = ("seed", "planner.pace", "limits.speed", "limits.acceleration", "spec.formula", "planner.method", "planner.samples")
"""Keys that are offered; any other may be typed."""
_RANGE = re.compile(r"(\d{1,15})\s*\.\.\s*(\d{1,15})")
_MOST = 200
_HINT = "Separated by commas, or one a line: 0.5, 0.7, 0.9. Whole numbers in a row: 0..9."


def values_of(text: str) -> tuple[Varied, ...]:
    """Return the values that a person typed: one a line; on a single line numbers and words separated by commas; `0..9` for whole numbers in a row.

    Raises:
        BadInput: There is none, or one is no value.
    """
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    if len(lines) == 1 and (found := _RANGE.fullmatch(lines[0])):
        low, high = int(found[1]), int(found[2])
        if not 0 <= high - low < _MOST:
            raise BadInput(f"{lines[0]} is no range of 1 to {_MOST} numbers.")
        return tuple(range(low, high + 1))
    if len(lines) == 1 and not re.search(r"[\[\]{}()&|]", lines[0]):
        lines = [part.strip() for part in lines[0].split(",") if part.strip()]
    if not lines:
        raise BadInput("Name the values that the key takes, such as 0.5, 0.7, 0.9.")
    return tuple(_value(line) for line in lines)


def _value(text: str) -> Varied:
    try:
        value: Any = json.loads(text)
    except ValueError:
        return text
    if isinstance(value, list):
        return tuple(value)  # whether it may hold what it holds, the mission's own rules say
    return value if isinstance(value, bool | int | float | str) else text


def begin_study(desk: Desk, text: Callable[[], str], pace: Callable[[], str]) -> None:
    """Ask for a key and its values, and make a study of what is written.

    Args:
        desk: What the person has open.
        text: Returns the mission.
        pace: Returns the pace that is asked for; empty for the mission's.
    """
    said = {"key": "seed", "values": "0..9", "name": ""}

    def typed(field: str) -> Callable[[Any], None]:
        return lambda event: said.__setitem__(field, str(event.args).strip())

    with ui.dialog() as dialog, box("dialog"), box("vary", tag="form") as form:
        Words("h2", "The same mission over values of one key")
        Words("p", "Each value is a job of its own; all are planned, proved and flown, and stand in one table.", "soft")
        _field("Key", "key", typed, value=said["key"], listed=_KEYS)
        with box(tag="label"):
            Words("span", "Values")
            area = ui.element("textarea").props("rows=4 name=values")
            area.props["defaultValue"] = said["values"]
            area.on("input", typed("values"), js_handler="(event) => emit(event.target.value)")
        Words("p", _HINT, "soft")
        _field("Called", "name", typed, hint="by its mission and key")
        with box("row"):
            button("Study it", lambda: None, "primary").props("type=submit")
            button("Close", dialog.close)

    async def made(_event: object) -> None:
        if not dialog.value:
            return
        try:
            found = await desk.service.studies_of(desk.principal).make(
                text(), said["key"], values_of(said["values"]), name=said["name"], pace=pace() or None
            )
        except LtlplanError as error:
            with form:
                say(error)
            return
        dialog.close()
        desk.show_study(found.id)

    submitted(form, made)
    dialog.open()


def _field(
    label: str,
    name: str,
    typed: Callable[[str], Callable[[Any], None]],
    *,
    value: str = "",
    listed: tuple[str, ...] = (),
    hint: str = "",
) -> None:
    with box(tag="label"):
        Words("span", label)
        made = ui.element("input").props(f"name={name} maxlength=200 autocomplete=off")
        made.props["defaultValue"], made.props["placeholder"] = value, hint
        if listed:
            made.props("list=varied-keys")
            with ui.element("datalist").props("id=varied-keys"):
                for each in listed:
                    ui.element("option").props["value"] = each
        made.on("input", typed(name), js_handler="(event) => emit(event.target.value)")
