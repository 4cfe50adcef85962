"""The page of an audit: what was asked of others' flights, whether it holds, and a picture of each of the tightest instants."""

from __future__ import annotations

import html
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from flight.figures import Figure
from ltlplan.report.audit_report.audit_pictures import overview, pair_or_drone
from ltlplan.report.page import figure_place, folded, listed, page_html, section, table
from verify.checked_claims import checked_of, proof_sentences

if TYPE_CHECKING:
    from verify import Audit
    from verify.claims.claim import Claim
    from verify.third_party.instants import Instant

MOST_CLAIMS = 2000
"""Rows of claims that a page has; the audit's JSON has all."""

MOST_PICTURES = 6
"""Instants that have a picture; a browser shows some eight scenes at once."""

_WORDS = {
    "separation": "distance of two drones", "workspace": "position beside a wall", "height": "least height", "altitude": "greatest height",
    "geofence": "distance from the geofence's border", "limits.speed": "speed", "limits.speed_xy": "horizontal speed",
    "limits.climb": "climb", "limits.descent": "descent", "limits.acceleration": "acceleration",
    "limits.acceleration_xy": "horizontal acceleration", "limits.acceleration_up": "upward acceleration",
    "limits.acceleration_down": "downward acceleration",
}  # fmt: skip
"""What a claim's instants are about."""


@dataclass(frozen=True, slots=True)
class _Shown:
    """An instant and what it is the tightest of."""

    name: str
    instant: Instant
    broken: bool


def audit_html(found: Audit) -> str:
    """Return one self-contained page for an audit. The same audit gives the same bytes."""
    shown = list(_shown(found))
    figures: dict[str, Figure] = {}
    pictures: list[str] = []
    if shown:
        first = shown[0].instant
        figures["overview"] = overview(found, first)
        label = f"All {found.drones} drones at {first.time:.2f} s; {_who(first)} marked."
        pictures.append(section("Where it is tightest", figure_place("overview", label, scene=True), note=label))
    for index, row in enumerate(shown[:MOST_PICTURES]):
        name = f"instant{index}"
        figures[name] = pair_or_drone(found, row.instant)
        label = _caption(row)
        heading = f"{_WORDS.get(row.name, row.name).capitalize()}, {_who(row.instant)}"
        pictures.append(section(heading, figure_place(name, label, scene=True), note=label))
    return page_html(
        "Audit of " + found.source,
        header=_header(found),
        sections=[_tightest(shown), *pictures, _claims(found), _asked(found), _notes(found)],
        figures=figures,
        footer=f"Audit {found.to_dict()['digest']} of the flights {found.digest}, by {_versions(found)}.",
    )


def _shown(found: Audit) -> Iterator[_Shown]:
    """Yield the tightest instants of each kind of claim: those that are broken first, then one of each kind, then the rest."""
    broken = {claim.name for claim in found.broken}
    whose = {(claim.name, claim.robot, claim.other) for claim in found.broken}
    rows = [(place, name, instant) for name, row in found.tightest.items() for place, instant in enumerate(row)]
    for place, name, instant in sorted(rows, key=lambda row: (row[1] not in broken, row[0], row[1] != "separation")):
        if place and (name, instant.robot, instant.other) not in whose:
            continue
        yield _Shown(name, instant, name in broken)


def _who(instant: Instant) -> str:
    return instant.robot if instant.other is None else f"{instant.robot} and {instant.other}"


def _unit(name: str) -> str:
    if not name.startswith("limits."):
        return "m"
    return "m/s^2" if "acceleration" in name else "m/s"


def _caption(row: _Shown) -> str:
    instant, unit = row.instant, _unit(row.name)
    return f"{_who(instant)} at {instant.time:.4f} s: {_figure(instant.value)} {unit}, limit {_figure(instant.limit)} {unit}."


def _figure(value: float) -> str:
    return f"{value:.6g}" if abs(value) > 1e-12 else "0"


def _header(found: Audit) -> str:
    """Return the verdict and the figures of the first screen."""
    if found.holds:
        verdict = f"Every claim holds, for all times from 0 to {found.duration:.2f} s."
    else:
        kinds = ", ".join(dict.fromkeys(claim.name for claim in found.broken))
        verdict = f"{len(found.broken)} of {len(found.claims)} claims are not proved: {kinds}."
    facts = [("Drones", str(found.drones)), ("Duration", f"{found.duration:.2f} s"), ("Pieces", str(found.pieces))]
    nearest = found.tightest.get("separation", ())
    if nearest:
        facts.append(("Closest two drones", f"{nearest[0].value:.4g} m"))
    proof = "judged" if found.kernel is None else f"{checked_of(found.claims)} checked"
    facts.append(("Proof", proof))
    margin = cast("float", found.asked["margin"])
    facts.append(("Margin", f"{1000 * margin:g} mm"))
    shown = "".join(f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(value)}</dd></div>" for name, value in facts)
    kind = "holds" if found.holds else "fails"
    return f'<p class="verdict {kind}">{html.escape(verdict)}</p><dl class="facts">{shown}</dl>'


def _tightest(shown: list[_Shown]) -> str:
    rows = [
        [
            _WORDS.get(row.name, row.name), _who(row.instant), f"{row.instant.time:.4f}", _figure(row.instant.value),
            _figure(row.instant.limit), _unit(row.name),
        ]
        for row in shown
    ]  # fmt: skip
    if not rows:
        return ""
    content = table(("what", "drones", "time (s)", "reached", "limit", "unit"), rows, numbers=(2, 3, 4))
    return section("The tightest instants", content, note="Where the flights come nearest to what is asked, or break it most.")


def _claims(found: Audit) -> str:
    ordered = sorted(found.claims, key=lambda claim: claim.outcome == "holds")
    rows = [[claim.name, claim.outcome, claim.proof, claim.sentence, _margin(claim)] for claim in ordered[:MOST_CLAIMS]]
    content = folded(table(("claim", "verdict", "proof", "", "margin"), rows, numbers=(4,), verdict=1), len(rows), "claims")
    content += listed(proof_sentences(found.claims, found.kernel))
    left = len(ordered) - len(rows)
    note = "Each is proved, or broken with a witness, for all times."
    if left:
        note += f" {left} more are in the audit's JSON (--out)."
    return section("Claims", content, note=note)


def _margin(claim: Claim) -> str:
    return "" if claim.margin is None else f"{_figure(claim.margin)} {claim.unit}"


def _asked(found: Audit) -> str:
    sources = cast("Mapping[str, str]", found.asked["from"])
    rows = [[name, _limit(found.asked.get(name)), source] for name, source in sources.items()]
    return section("What was asked", table(("limit", "value", "from"), rows, numbers=(1,)))


def _limit(value: object) -> str:
    if isinstance(value, float):
        return _figure(value)
    if isinstance(value, list) and value and isinstance(value[0], dict):
        return f"{len(cast('list[object]', value))} polygons"
    return str(value)


def _notes(found: Audit) -> str:
    return section("Not judged", listed(found.notes)) if found.notes else ""


def _versions(found: Audit) -> str:
    return ", ".join(f"{name} {version}" for name, version in found.versions.items())
