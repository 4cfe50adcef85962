"""Planted faults that change nothing, each with the reason why."""

EQUIVALENT: dict[str, str] = {}
"""By the fault's name."""
