"""Faults planted in the kernel that no test can notice, each with the reason why; by their names, which hold the text and not its line."""

EQUIVALENT: dict[str, str] = {
    "asked: low > by -> low >= by": "at equality the ball is inside where its centre is the region's own, which is so",
    "_following: places.laps[target] == 2 -> places.laps[target] != 2": "from the copy of a lap the walk goes on in the lap itself, whose places show the same and lead over the same seam",
    "_asked: 0 -> 1 #1": "of a limit of a quarter turn, or more, the cosine is taken as 2^-64 in place of 0",
    "Pair.parts: self._are_far(one.box, other.box) -> self._are_far(other.box, one.box)": "two boxes are as far apart whichever is named first",
    "Course.waits: 0 -> 1 #1": "it is the lap of a visit before the laps, whose number no lap changes; what it waits for in a lap is too late in each",
    "_cosine_and_sine: 10 -> 9": "two parts in 9^39 for each turn instead of 10^39: wider by less than an interval can tell",
    "Polynomial.stretched: 0 -> 1": "a polynomial without coefficients, or with one, is written over a greater power of two",
    "flights: 4096 -> 4095": "only how long a flight may be at the most, by one piece",
    "Course.windows: self.length -> not self.length": "ways of a later lap are those of the first: what a seam cuts off, the way from before it holds",
    "_cosine_and_sine: 0 -> 1 #2": "one end moves by 2^-64, less than by what the angle was widened",
    "timelines: 3 -> 4": "one lap more is looked at, which repeats the one before",
    "choices: _meet(face, other) -> _meet(other, face)": "whether two inequalities meet does not depend on which is named first",
    "statement: 64 -> 63 #2": "only how much the kernel looks at, by one",
    "_cosine_and_sine: 2 -> 1 #1": "the angle is less another number of full turns, which changes neither sine nor cosine, and what Taylor's sums leave out is still added",
    "_scale: 2 -> 1 #3": "halving begins at twice the bound, and ends above it all the same",
    "_scale: 32 -> 33": "one halving more: the bound is still one, and lower by less than 2^-32 of itself",
    "places_of: 1 -> 2": "one region more than are open cannot be chosen",
}
"""By the fault's name."""
