"""The API does what its schema says, whatever is asked: requests are made from the schema, and answers held against it."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from ltlplan.service.client_parts.job_handle import Submitted
from tests.helpers.serving.services import Served

SAME_WORK = ("/archive", "/recheck", "/exports")
"""Routes that do a second of work, and the same whatever is asked of them: fewer examples say as much."""


def _held_to_its_schema(served: Served, job: str, count: int) -> set[str]:
    """Ask every route, with ids that are there and those that are not, and return the routes whose answers were as they should be."""
    import schemathesis  # loads much, which other tests do not need
    from schemathesis.checks import not_a_server_error
    from schemathesis.specs.openapi.checks import content_type_conformance, response_schema_conformance, status_code_conformance

    checks = [not_a_server_error, status_code_conformance, content_type_conformance, response_schema_conformance]
    schema = schemathesis.openapi.from_url(f"{served.url}/openapi.json")
    asked: set[str] = set()
    for found in schema.get_all_operations():
        operation = found.ok()

        computes = any(part in operation.label for part in SAME_WORK)

        @settings(
            max_examples=max(1, count // 6) if computes else count,
            deadline=None,
            database=None,
            derandomize=True,
            phases=[Phase.explicit, Phase.generate],  # without shrinking, which would ask again for minutes what has failed
            suppress_health_check=list(HealthCheck),
        )
        @given(case=operation.as_strategy(), ours=st.booleans())
        def ask(case: Any, ours: bool) -> None:
            if ours and "job" in case.path_parameters and case.method != "DELETE":
                case.path_parameters["job"] = job
            answer: Any = case.call(timeout=60)
            case.validate_response(answer, checks=checks)

        ask()
        asked.add(operation.label)
    return asked


def test_every_route_does_what_its_schema_says(served: Served, done: Submitted) -> None:
    assert len(_held_to_its_schema(served, done.id, 1)) > 20


@pytest.mark.slow
def test_every_route_does_what_its_schema_says_at_length(served: Served, done: Submitted) -> None:
    assert len(_held_to_its_schema(served, done.id, 60)) > 20
