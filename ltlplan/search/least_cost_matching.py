"""Assignments of columns to rows at the least cost: by the sum, or by the highest cost first."""

from __future__ import annotations

import numpy as np

from verify.data.arrays import Floats


def cheapest_assignment(costs: Floats, *, longest: bool, slack: float = 0.0) -> list[tuple[int, int]] | None:
    """Return an assignment of columns to rows at the least cost, as pairs; None where some column can be assigned to no row.

    Args:
        costs: Infinite where a row cannot take a column. Shape (rows, columns), no fewer rows than columns.
        longest: Whether the highest cost counts (Gross 1959), and the sum only then.
        slack: By how much a cost may be higher than the least highest one.
    """
    from scipy.optimize import linear_sum_assignment  # here: they take long to load, and few plans need them
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import maximum_bipartite_matching

    limits = np.unique(costs[np.isfinite(costs)])
    low, high = (0, len(limits)) if longest else (len(limits) - 1, len(limits) - 1)
    while low < high:
        middle = (low + high) // 2
        matched = maximum_bipartite_matching(csr_matrix(limits[middle] >= costs.T), perm_type="column")
        low, high = (low, middle) if (matched >= 0).all() else (middle + 1, high)
    if not 0 <= low < len(limits):
        return None
    cheap = np.where(costs <= limits[low] + slack, costs, 1e6 * (1.0 + limits[low]))
    rows, columns = linear_sum_assignment(cheap)
    return list(zip(rows.tolist(), columns.tolist(), strict=True))
