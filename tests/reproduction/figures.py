"""The figures of docs/reproduction beside the commands that print them, and what a page may say without a rerun.

Each `Figure` holds a passage of a page against a passage of a command's output. In both, `#` stands for a number,
`~` for a number that is not compared, `...` for anything within the line; numbers are compared in their order. `within` is the greatest difference, absolute or as a share, with its reason.
"""

from __future__ import annotations

from dataclasses import dataclass

HOOPS = ("tests/benchmarks/hoops_scenarios.py",)
CASES = ("tests/benchmarks/cases.py",)
SOFT = ("tests/benchmarks/soft_parts.py", "0", "published")
MTAC = ("-m", "tests.benchmarks.mtac_figures", "fig10", "fig11", "fig12", "fig13", "fig14", "fig16", "online_plan", "sizes")

EXACT = 0.0
"""Spans and words that no rounding changes: the page's digits must be the command's, rounded to them."""

DRAWN = 0.03
"""Paths found by sampling: with the kernels fixed, other versions of libm may still round the last bit of a cost otherwise."""

FLOWN = 0.15
"""Errors of a simulated flight, whose last bits grow over thousands of steps."""


@dataclass(frozen=True)
class Figure:
    """A passage of a page and the command's passage that it repeats.

    Attributes:
        page: In docs/reproduction.
        said: The passage of the page.
        command: Arguments of Python.
        printed: The passage of the output; all its matches in order give the numbers.
        within: Greatest difference as a share of the number, beyond what the page's digits round.
    """

    page: str
    said: str
    command: tuple[str, ...]
    printed: str
    within: float = EXACT


def _case(said: str, printed: str, flight: bool = True) -> Figure:
    """Return a row of the published cases: its cost and its flight's length; times of computing are not compared."""
    after = " | ... s | # s |" if flight else ""
    return Figure(
        "cases.md", f"| {said} | ... s | # m... | yes{after}", CASES, f"{printed} | ... s | # m | yes{after.removesuffix(' |')}"
    )


FIGURES = (
    Figure("hoops.md", "certified for all times; # m nominal", HOOPS, "hoops-sequence nominal #"),
    Figure("hoops.md", "certified for all times; 8.83 m nominal, # m after cross-entropy", HOOPS, "hoops-sequence optimised #", DRAWN),
    Figure("hoops.md", "one lap # m nominal", HOOPS, "hoops-ltl nominal ~ #"),
    Figure("hoops.md", "m nominal, # m after cross-entropy | `ltlplan run hoops-ltl`", HOOPS, "hoops-ltl optimised ~ #", DRAWN),
    Figure("hoops.md", "prefix # m at once, suffix # m nominal; at most 5 m", HOOPS, "seed 0: prefix # m, suffix # m;"),
    Figure("hoops.md", "after #, # and # rounds of 50 samples", HOOPS, "m; after # rounds of 50 samples", 0.25),
    Figure("hoops.md", "(seeds 0 to 2: #, #, # m)", HOOPS, "rounds of 50 samples ... m and # m; J", 0.15),
    Figure("hoops.md", "prefix # m, lap # m; after 60 rounds", HOOPS, "hoops-published nominal # #"),
    Figure("hoops.md", "after 60 rounds of 200 samples # m and # m", HOOPS, "hoops-published optimised # #", DRAWN),
    Figure("mtac.md", "water, smoke, loc2 (cost #, # m)", MTAC, "quad0: water smoke loc2 cost # length # m", DRAWN),
    Figure("mtac.md", "quad2: loc1 (cost #, # m)", MTAC, "quad2: loc1 cost # length # m", DRAWN),
    Figure("mtac.md", "for loc2: quad0 # to #, ", MTAC, "the printed cost, quad0: # ... # flown", DRAWN),
    Figure("mtac.md", ", quad1 # to #, ", MTAC, "the printed cost, quad1: # ... # flown", DRAWN),
    Figure("mtac.md", ", quad2 # to #; by length", MTAC, "the printed cost, quad2: # ... # flown", DRAWN),
    Figure("mtac.md", "by length alone # to # m, ", MTAC, "length alone, quad0: # ... # flown", DRAWN),
    Figure("mtac.md", "3.11 m, # to # m, ", MTAC, "length alone, quad1: # ... # flown", DRAWN),
    Figure("mtac.md", "3.49 m, # to # m |", MTAC, "length alone, quad2: # ... # flown", DRAWN),
    Figure("mtac.md", "their means: # m at first", MTAC, "t = 0.0 s: mean distance of samples from their means # "),
    Figure("mtac.md", "m at first, #, #, #, # and # m after 10 s", MTAC, "t = 10.0 s: mean distance of samples from their means # # # # # m", DRAWN),
    Figure("mtac.md", "from #: a = 0.1 is # after 2 s", MTAC, "a = 0.1 b = 0.01 Delta at 0, 1, .., 10 s: # ~ #", DRAWN),
    Figure("mtac.md", "a = 0.01 reaches # at 5 s", MTAC, "a = 0.01 b = 0.001 Delta at 0, 1, .., 10 s: ~ ~ ~ ~ ~ #", DRAWN),
    Figure("mtac.md", "a = 0.001 ends at #", MTAC, "a = 0.001 b = 0.0001 Delta at 0, 1, .., 10 s: ~ ~ ~ ~ ~ ~ ~ ~ ~ ~ #", DRAWN),
    Figure("mtac.md", "| online #, #, #, #, #; offline (paper's settings) #, #, #, #, #; by length alone", MTAC,
           "| online #, #, #, #, #; offline (paper's settings) #, #, #, #, #; by length alone", DRAWN),
    Figure("mtac.md", "by length alone online #, #, #, #, #; offline (paper's settings) #, #, #, #, # m", MTAC,
           "by length alone online #, #, #, #, #; offline (paper's settings) #, #, #, #, # m", DRAWN),
    Figure("mtac.md", "Online is lower by # to # % (by length # to # %)", MTAC, "Online is lower by # to # % (by length # to # %)", 0.2),
    Figure("mtac.md", "{}, {} {loc1} {}; # s, satisfied after # s", MTAC, "firefighting flew # s; the formula was satisfied after # s", DRAWN),
    Figure("mtac.md", "worst tracking error # mm", MTAC, "worst distance from where the robots should have been: # mm", FLOWN),
    Figure("mtac.md", "T has # N nodes (# automaton states, # robot states)", MTAC, "1 robots: T # = N x # x # nodes"),
    Figure("mtac.md", "Fig. 16's words after # s of simulated time", MTAC, "Online MTAC-E flew # s of simulated time", DRAWN),
    Figure("mtac.md", "of simulated time, # m, certified", MTAC, "cost # m. Online MTAC-E", DRAWN),
    Figure("soft_parts.md", "`r1 (r2 r1)*`, # m by straight lines", SOFT, "r1 r2 r1, # m by straight lines"),
    Figure("soft_parts.md", "without the soft part `r1 (r3 r1)*`, # m", SOFT, "r1 r3 r1, # m by straight lines"),
    _case("Bai, first: two robots, for ever | 225 product states, 10.6 s", "Bai, first | 225 product states, 10.6 s"),
    _case("Bai, second: two robots | ...", "Bai, second | ..."),
    _case("Schillinger, second: six robots, 112 places | ...", "Schillinger, second | ..."),
    _case("the same under `joint`, with counts | ...", "Schillinger, second, joint | ..."),
    _case("Schillinger, third: six robots, 112 places | ...", "Schillinger, third | ..."),
    _case("the same under `joint`, with counts and a robot that is named | ...", "Schillinger, third, joint | ..."),
    _case("LOMAP, fifth: a patrol of two, for ever | ...", "LOMAP, fifth | ..."),
    _case("two meet in each lap, ... | -", "a meeting in each lap | -"),
    _case("the same with `objective: longest` | -", "a meeting in each lap, by the dearer robot | -"),
    _case("five robots gather, ... | -", "five gather | -"),
    _case("ten meet, ... | -", "ten meet | -"),
    _case("the same for thirty | -", "thirty meet | -", flight=False),
)  # fmt: skip

NOT_RERUN = {
    "hoops.md": (
        ("IROS 2019", "a year"),
        ("3.2 x 2.6 x 1.8 m", "the shipped missions' workspace"),
        ("4.1, Fig. 4:", "the paper's numbering"), ("4.2, Fig. 5:", "the paper's numbering"),
        ("4.2, read as", "the paper's numbering"), ("4.3, Fig. 7:", "the paper's numbering"),
        ("control points 1.1 m from hoop2", "the course's, in the benchmark"),
        ("0.45 m/s | 0.45 m/s", "a setting"),
        ("0.16 m for two points 1 and 0.99 m apart along and across the normal, whose distance is 1.41 m", "arithmetic"),
        ("`delta = 1/4`", "a setting"), ("2 cm beyond it", "a setting"), ("up to 1 s more", "a setting"),
        ("each at most 5 m", "the paper's"), ("both below 5 m", "the paper's"), ("at most 5 m after", "the paper's limit"), ("here 5 m)", "the paper's limit"),
        ("8.83 m nominal,", "compared above"),
    ),
    "mtac.md": (
        ("Section 5.2", "the paper's numbering"), ("Section 5.4", "the paper's numbering"), ("eq. 6.4's", "the paper's numbering"),
        ("Section 6.4", "the paper's numbering"),
        ("the 0.05-quantile's", "a setting"), ("(Sigma = 0.05 I, rho = 0.05)", "the paper's settings"),
        ("shrink to 60 %", "0.08 of 0.133, in words"), ("a = 0.1 is", "a setting"), ("a = 0.01 reaches", "a setting"),
        ("a = 0.001 ends", "a setting"), ("larger a follows the costs' differences sooner and 0.001", "a setting"),
        ("8.3, 9.0, 6.5, 6.2, 6.5 times less; by length alone 3.4, 5.9, 5.0, 5.5, 5.1", "ratios of times of computing"),
        ("127 s there", "the paper's"), ("0.45 m/s nominal", "a setting"), ("ellipsoid of 0.2 m", "the mission's"),
        ("about every 0.35 m", "a setting"), ("for 3 s,", "a setting"), ("fly on for 0.2 s", "a setting"),
        ("the 0.2 s before slowing down", "a setting"), ("about 0.05 s for three robots", "a time of computing"),
        ("by length alone 3.40 to 3.11 m, 3.78 to 3.49 m,", "compared above"),
        ("after 10 s |", "the figure's axis"), ("after 2 s", "the figure's axis"), ("at 5 s", "the figure's axis"),
    ),
    "soft_parts.md": (),
    "cases.md": (
        ("225 product states, 10.6 s", "published"), ("0.41 s by search, 3.7 s by sampling", "published"), ("11.5 s, cost 88", "published"),
        ("21.1 s, cost 98", "published"), ("pay 5.8 m each", "compared in the table"), ("0.3 m apart at least", "the missions'"),
        ("Python 3.11", "a version"),
    ),
}  # fmt: skip
"""Numbers that no command prints, as passages of a page with the reason."""

TIMES_OF_COMPUTING = {"cases.md": (r"\| [\d.]+ s \| (?=[\d._]+ m)", r"yes \| [\d.]+ s \|")}
"""Cells of tables that are times of computing, as patterns; they are not compared."""
