"""Planted faults that change nothing, each with the reason why."""

_ZERO = "where an end is zero itself, the least square and the least magnitude of the ends are zero as well"

EQUIVALENT: dict[str, str] = {
    "Interval.squared: self.low <= 0 -> self.low < 0": _ZERO,
    "Interval.squared: self.high >= 0 -> self.high > 0": _ZERO,
    "Interval.magnitude: self.low <= 0 -> self.low < 0": _ZERO,
    "Interval.magnitude: self.high >= 0 -> self.high > 0": _ZERO,
    "ways: low < high -> low <= high": "a window from a time to itself holds no time, and legs are judged over longer parts only",
    "_near: d_low.min(-1) >= -bound -> d_low.min(-1) > -bound": (
        "a part that just reaches the bound is halved instead of taken whole, and its halves count as near as well"
    ),
    "_at_least: Fraction(high) < limit -> Fraction(high) <= limit": (
        "what is reached is rounded up to a next float, so at equality the path is nearer than the limit, as the exact answer says"
    ),
    "extent: 44 -> 45": "both bounds are proved before they are returned; only how near the first attempt is, a part in 2^44",
    "progression: 10000000 -> 10000001": "only how soon the budget of an undecided answer ends, by one node",
    "_with_visit: float(s.start) <= time <= float(s.stop) -> float(s.start) <= time < float(s.stop)": (
        "the time is that of a letter in which the region holds, which begins before the robot is out of it for sure"
    ),
    "_refuse_jumps: 17 -> 18": "only how many digits a message writes where 16 do not tell two floats apart, which 17 do",
    "Tableau._ways: 0 -> 1 #2": (
        "that marks entry 0 as put off, which is a name or a constant (parts come before what they are part of), and only "
        "F, U and M count as put off; at most a way that asks for more than another is kept beside it"
    ),
    "JointShuffle.stronger: 0 -> 1": "a state is compared with itself only, and its bits are the same each time, whatever they are",
    "_end_value: -1 -> 1 #3": "the sum is over the last of two axes, which is axis 1",
    "_same_sentence: True -> False #1": "texts that are equal but for their numbers have equally many, as each leaves one zero",
    "read_team: True -> False": "trajectories and knots are equally many: each one's knots are made from it",
    "_tangents: state[2].low.min(-1) > 0 -> state[2].low.min(-1) >= 0": (
        "where fz is proved not to be negative, its square's bounds say where it may be zero: there the quotient is infinite too"
    ),
    "show: 1 -> 2": "of a long formula one part more is counted than is needed to see that it is long",
    "formula: 9 -> 10 #1": "no operator binds as strongly from the left as 9, so 9 and 10 read the same formulas",
    "tracks: 2000000 -> 2000001": "only how many parts of gaps are looked at before the samples cannot tell",
    "statuses: 20 -> 21": "only how finely the edge of what may be inside is told, half a millionth of a piece or a millionth",
    "trajectory_csv: 4000000 -> 4000001": "only how large a file is read, by one byte",
    "spot_opinion: 8 -> 9": "only where Spot is asked, in this process or in one of its own; the question is the same",
    "approaches: 4 -> 5": "only at how many places it is looked first how near a robot comes; what is proved is of all",
    "Tangents.tangents: np.maximum(square, 0.0) * GROW -> np.maximum(square, 0.0) / GROW": (
        "the root of it is widened by more right after"
    ),
    "apart_by_one: rows.bound_errors + gamma(3) * np.abs(rows.bounds) -> rows.bound_errors - gamma(3) * np.abs(rows.bounds)": (
        "a bound is at most what the products and the distance come to, and both are allowed for by more than that each"
    ),
    "surface_of: 3 -> 4": "a round body has no edges, and where there are none nobody asks how many coordinates they have",
    "weights_of: 1e-150 -> 2e-150": "only what stands for the length of a half-space that has no normal",
    "cutting: 1e-09 -> 2e-09": "the margin is taken larger by two nanometres where one suffices; nothing is claimed of less",
    "_is_beyond: Fraction(one.low) > limit -> Fraction(one.low) >= limit": (
        "what is proved is rounded down, so at equality the path stays farther away than the limit"
    ),
    "_at_meeting: most <= 0 -> most < 0": "a plane without weight has no part in the equations: its unknown is zero whatever stands there",
    "apart_by_one: least / most * (1 - 2.0 ** (-51)) -> least / most / (1 - 2.0 ** (-51))": (
        "the length is taken longer by 2^-49 of itself, which is more than its own rounding and that of the quotient"
    ),
    "apart_by: 2.0 -> 4.0": "the errors of a sum of normals make its length longer by more than its rounding",
    "Opening.distances: (np.einsum('i,nik->nk', known, size) + np.einsum('i,nik->nk', np.abs(self.normal), rad)) * GROW + TINY -> "
    "(np.einsum('i,nik->nk', known, size) + np.einsum('i,nik->nk', np.abs(self.normal), rad)) * GROW - TINY": (
        "so small a number changes no bit of a distance that is not as small"
    ),
    "apart_by: 51 -> 52": "the length is taken longer by 2^-49 of itself, which is more than its own rounding and that of the quotient",
    "_Parser._in_parentheses: 0 -> 1": "no operator binds as weakly from the left as 0, so 0 and 1 read the same formulas",
    "_covering: True -> False #1": "every letter's column has a row for each state",
    "_Flight.actions: False -> True #1": "where a robot begins is all that is asked of its first entry",
    "surface_of: np.abs(corners @ body.normals.T - body.distances) <= _ON * (1 + np.abs(corners).max(initial=0.0)) -> "
    "np.abs(corners @ body.normals.T - body.distances) < _ON * (1 + np.abs(corners).max(initial=0.0))": (
        "a corner lies on a face but for rounding, or much farther away"
    ),
    "_at_sample: level[0] + slack <= (1 - reach) ** 2 -> level[0] + slack < (1 - reach) ** 2": (
        "a sample that is inside by just the slack is no longer said to be: one float, on the side that says less"
    ),
    "_apart: 1 -> 2 #1": "a share is 1 at most, and less than that after something is taken from it",
    "_Search.of: 16.0 -> 32.0": "only by how much longer than the flights the time is by which drones' keys lie apart",
    "_Search._state: -1 -> 1 #2": "of two coefficients, all but the last are the first",
    "_Search._state: time - starts[:, 0] - starts[:, 1] -> time - starts[:, 0] + starts[:, 1]": (
        "the second part of a start is what a float loses of it, and times may be off by more than that there"
    ),
    "_Search._slice: speed * half -> speed / half": (
        "half a part is a second at the most: within a larger radius more pairs are looked at, and none less"
    ),
    "_quotient: 1e-290 -> 2e-290": "so small a number is there only where all others are zero",
    "moved: True -> False": "points of three coordinates are paired, always",
}
"""By the fault's name."""
