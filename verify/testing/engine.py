"""The door to hypothesis, which an extra brings."""

from __future__ import annotations

from verify.data.errors import MissingEngine

try:
    from hypothesis import strategies
    from hypothesis.strategies import DrawFn, SearchStrategy, composite
except ImportError:
    raise MissingEngine("Strategies for tests need hypothesis: pip install 'ltlplan[hypothesis]'.") from None

__all__ = ["DrawFn", "SearchStrategy", "composite", "strategies"]
