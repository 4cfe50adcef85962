"""Metrics of a running service for Prometheus: requests as they are answered, and counts of everything else when they are asked for. The one door to prometheus-client."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Protocol

from ltlplan.service.models import Health
from ltlplan.service.people.accounts import Account
from ltlplan.service.people.roles import Role
from verify.data.errors import MissingEngine

if TYPE_CHECKING:
    from ltlplan.service.job_queue.jobs import Jobs
    from ltlplan.service.people.people import People
    from ltlplan.service.query_pool import Questions

_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0)
_METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


class Metrics:
    """Metrics of one service.

    Attributes:
        media_type: Of what `text` returns.
    """

    def __init__(self) -> None:
        """Begin to count.

        Raises:
            MissingEngine: prometheus-client is not installed.
        """
        try:
            from prometheus_client import CollectorRegistry, Counter, Histogram, ProcessCollector
            from prometheus_client.exposition import CONTENT_TYPE_LATEST
        except ModuleNotFoundError:
            raise MissingEngine("Metrics need prometheus-client: pip install 'ltlplan[service]'.") from None
        self.media_type = CONTENT_TYPE_LATEST
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        labels = ("method", "route")
        self._requests = Counter(
            "ltlplan_requests", "Requests that were answered.", (*labels, "status"), registry=self._registry
        )
        self._seconds = Histogram(
            "ltlplan_request_seconds", "Time to the end of the answer.", labels, registry=self._registry, buckets=_SECONDS
        )

    def answered(self, method: str, route: str, status: int, seconds: float) -> None:
        """Count a request.

        Args:
            method: Of HTTP.
            route: The route's own path, with its parameters by name: there are not many.
            status: HTTP status.
            seconds: s that it took.
        """
        method = method if method in _METHODS else "other"
        self._requests.labels(method, route, str(status)).inc()
        self._seconds.labels(method, route).observe(seconds)

    def text(self, service: Counted, health: Health) -> bytes:
        """Return everything in Prometheus' text format.

        Args:
            service: What is counted.
            health: As it is now.
        """
        from prometheus_client import CollectorRegistry, generate_latest
        from prometheus_client.core import GaugeMetricFamily

        class Present:
            """Counts as they are now."""

            def collect(self) -> Iterator[Any]:  # of prometheus-client's types
                for name, (words, label, values) in _present(service, health).items():
                    family = GaugeMetricFamily(f"ltlplan_{name}", words, labels=[label] if label else [])
                    for key, value in values.items():
                        family.add_metric([key] if label else [], float(value))
                    yield family

        present = CollectorRegistry()
        present.register(Present())
        return generate_latest(self._registry) + generate_latest(present)


class Counted(Protocol):
    """A service, as far as it is counted."""

    @property
    def jobs(self) -> Jobs:
        """Jobs, accepted and done."""
        ...

    @property
    def questions(self) -> Questions:
        """Questions that are answered at once."""
        ...

    @property
    def people(self) -> People:
        """People, with accounts and sessions."""
        ...


Counts = dict[str, tuple[str, str, dict[str, float]]]


def _present(service: Counted, health: Health) -> Counts:
    """Return what there is now: by name its meaning, what its values are told apart by, and these."""
    accounts = service.people.accounts.all()
    return {
        "healthy": ("1 if /health is ok.", "", {"": float(health.ok)}),
        "jobs": (
            "Jobs by state, without exports.",
            "state",
            {state: float(count) for state, count in service.jobs.register.counts().items()},
        ),
        "workers": ("Stages that may run at once.", "", {"": health.workers}),
        "worker_processes": ("Processes that are running.", "", {"": health.alive}),
        "interrupted_jobs": ("Jobs that do not go on at the moment.", "", {"": len(health.interrupted)}),
        "questions": (
            "Questions that wait or are being answered, by lane.",
            "lane",
            {k: float(v) for k, v in service.questions.open.items()},
        ),
        "free_bytes": ("Bytes that are free where the data is.", "", {"": health.room}),
        "accounts": ("Accounts that may log in, by role.", "role", _by_role(accounts)),
        "sessions": ("Browsers that are logged in to accounts.", "", {"": sum(service.people.sessions.counts().values())}),
        "build_info": ("Always 1.", "version", {health.versions.get("ltlplan", "unknown"): 1.0}),
    }


def _by_role(accounts: list[Account]) -> dict[str, float]:
    return {role.name: float(sum(each.role is role and each.disabled is None for each in accounts)) for role in Role}
