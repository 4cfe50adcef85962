"""Control of a flight: one pilot tells it events, and hands that on to another by an offer that the other accepts.

Stopping a flight needs no control. Nobody has it at first; the first who tells the flight an event, or takes control, does.
"""

from __future__ import annotations

from typing import Literal

from ltlplan.service.problems import Conflict
from verify.data import BadInput

Act = Literal["take", "offer", "accept", "decline", "release"]
"""Take control that nobody has; offer it; accept or decline an offer (or take it back); give it up (or, as an admin, take it from somebody)."""

Control = tuple[str | None, str | None]
"""Who is in control, and to whom that is offered."""


def require_control(name: str, pilot: str | None, who: str) -> None:
    """Reject who is not in control of a flight that somebody else is in control of.

    Args:
        name: What it listens as.
        pilot: Who is in control; None for nobody.
        who: Who asks.

    Raises:
        Conflict: Somebody else is.
    """
    if pilot not in (None, who):
        raise Conflict(
            f"{pilot} is in control of '{name}' and tells it events; ask {pilot} to hand control over. Anybody may stop it."
        )


def changed(name: str, control: Control, act: Act, who: str, *, to: str = "", admin: bool = False) -> Control:
    """Return who is in control of a flight after somebody has done something.

    Args:
        name: What it listens as.
        control: As it was.
        act: What is done.
        who: Who does it.
        to: To whom control is offered.
        admin: Whether who does it is an admin.

    Raises:
        Conflict: That cannot be done as it is.
        BadInput: Control is offered to nobody, or to oneself.
    """
    pilot, offered = control
    match act:
        case "take":
            require_control(name, pilot, who)
            return who, offered
        case "offer":
            if pilot != who:
                raise Conflict(f"You are not in control of '{name}'; {pilot or 'nobody'} is.")
            if not to or to == who:
                raise BadInput("Control is offered to another pilot, by name.")
            return who, to
        case "accept":
            if offered != who:
                raise Conflict(f"Control of '{name}' is not offered to you.")
            return who, None
        case "decline":
            if who not in (pilot, offered):
                raise Conflict(f"Control of '{name}' is neither yours nor offered to you.")
            return pilot, None
        case "release":
            if pilot != who and not admin:
                raise Conflict(f"You are not in control of '{name}'; {pilot or 'nobody'} is.")
            return None, None
