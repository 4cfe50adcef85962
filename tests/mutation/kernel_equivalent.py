"""Faults planted in the kernel that no test can notice, each with the reason why; by their names, which hold the text and not its line."""

EQUIVALENT: dict[str, str] = {
    "asked: low > by -> low >= by": "at equality the ball is inside where its centre is the region's own, which is so",
    "_scale: 0 -> -1 #2": "a range of fewer than none is empty",
    "_following: places.laps[target] == 2 -> places.laps[target] != 2": (
        "from the copy of a lap the walk goes on in the lap itself, whose places show the same and lead over the same seam"
    ),
    "Segment._forms: 0 -> 1": "x x and x y have one degree",
    "_asked: 0 -> 1 #1": "of a limit of a quarter turn, or more, the cosine is taken as 2^-64 in place of 0",
    "Pair.parts: self._are_far(one.box, other.box) -> self._are_far(other.box, one.box)": "two boxes are as far apart whichever is named first",
    "Segment.within: 0 -> 1": "a polynomial that is moved by nothing is the same",
    "choices: meet(face, other) -> meet(other, face)": "whether two inequalities meet does not depend on which is named first",
    "Course.waits: 0 -> 1 #1": "it is the lap of a visit before the laps, whose number no lap changes; what it waits for in a lap is too late in each",
    "_cosine_and_sine: 10 -> 9": "two parts in 9^39 for each turn instead of 10^39: wider by less than an interval can tell",
    "places_of: require(seen & final, f'the labels of {timeline.robot} contradict each other') -> "
    "require(f'the labels of {timeline.robot} contradict each other', seen & final)": (
        "outside, open and inside never contradict each other: where the one ends as the other begins, the instant itself is open"
    ),
    "Polynomial.__add__: len(long) < len(short) -> len(long) <= len(short)": "of two that are equally long either may be added to the other",
    "Polynomial.stretched: 0 -> 1": "a polynomial without coefficients, or with one, is written over a greater power of two",
    "flights: 4096 -> 4095": "only how long a flight may be at the most, by one piece",
    "operands: 1 -> 2 #2": "no operator that is unknown has -2 operands, nor -1",
    "zones: 4 -> 5": "a matrix of four rows has no fifth",
    "Course._over: 1 -> 2": "a stay that ends in the third lap begins in the second; in the first the same happens a lap earlier",
    "timelines: 3 -> 4": "one lap more is looked at, which repeats the one before",
}
"""By the fault's name."""
