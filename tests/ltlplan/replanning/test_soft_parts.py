"""Soft parts: what is kept and given up, against all subsets; what the certificate says; and what relaxes an impossible formula."""

from __future__ import annotations

import contextlib
import itertools
import json
import random
from pathlib import Path

import pytest

import ltlplan
import verify
from ltlplan.pipeline import certified_team
from ltlplan.replanning.soft_parts import kept_by_words
from ltlplan.report.summary import soft_sentences
from ltlplan.reproduction.published_missions import loads
from ltlplan.search.exact import assign
from ltlplan.search.explanations.unsatisfiable_cores import NoPlan
from tests.helpers.few import few_of
from tests.helpers.missions.own_places import own_places
from tests.helpers.missions.worlds import world
from verify.data import BadInput, Mission, NotCertified, Unsatisfiable, mission_to_yaml, parse_mission
from verify.run_folder import recheck

SMALL = {"a": (0.0, 0.0), "b": (2.0, 0.0), "c": (2.0, 1.5)}
SOFT = (
    ("F c", 2.0), ("G !c", 1.0), ("!b U a", 1.5), ("F(b & F a)", 1.0), ("G !b", 3.0), ("F(a & F(b & F a))", 0.5),
)  # fmt: skip


def wishing(formula: str, *soft: tuple[str, float], robots: int = 1, **more: str) -> Mission:
    """Return a small mission with soft parts."""
    plain = world(formula, robots=robots, regions=SMALL, **more)  # type: ignore[arg-type]
    parts = [{"formula": text, "weight": weight} for text, weight in soft]
    return plain.changed(spec={**plain.spec.model_dump(), "soft": parts})


def assert_best(mission: Mission) -> None:
    """Hold a plan against the cheapest ones that keep each set of soft parts."""
    made, soft = ltlplan.plan(mission), mission.soft_parts
    kept = kept_by_words(mission, made.words)
    costs: dict[frozenset[int], float] = {}
    for those in (
        frozenset(those) for size in range(len(soft) + 1) for those in itertools.combinations(range(len(soft)), size)
    ):
        asked = [mission.spec.formula or "true", *(soft[i].formula for i in sorted(those))]
        with contextlib.suppress(Unsatisfiable):
            costs[those] = assign(mission.asking(" & ".join(f"({text})" for text in asked)), explained=False).cost
    best = max((sum(soft[i].weight for i in those), -cost) for those, cost in costs.items())
    assert sum(soft[i].weight for i in kept) == best[0]
    straight = assign(made.mission.asking(made.mission.spec.formula)).cost if not kept else costs[kept]
    assert straight == pytest.approx(-best[1])
    assert verify.check_team(mission.formula, made.words, team=mission.spec.team).sequential


@few_of(1, ("formula", "robots"), [("F a", 1), ("F b & (!c U a)", 1), ("F(a | b)", 2)])
def test_no_set_of_soft_parts_weighs_more_or_costs_less(formula: str, robots: int) -> None:
    assert_best(wishing(formula, *SOFT[: 6 if robots == 1 else 4], robots=robots))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_random_soft_parts_against_every_subset(seed: int) -> None:
    draw = random.Random(seed)
    shapes = ("F {}", "G !{}", "!{} U {}", "F({} & F {})", "G({} -> F {})", "F G !{}", "F {} & G !{}", "{} R !{}", "free U {}")

    def part() -> str:
        shape = draw.choice(shapes)
        return shape.format(*(draw.choice("abc") for _ in range(shape.count("{}"))))

    soft = [(part(), draw.choice([0.1, 0.2, 0.3, 1.0])) for _ in range(5)]
    robots, team = draw.choice([(1, "own"), (2, "own"), (2, "joint")])
    assert_best(wishing(draw.choice(["F a", "F(a | b)", "true"]), *soft, robots=robots, team=team))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 108))
def test_random_soft_sequences_against_every_subset(seed: int) -> None:
    draw = random.Random(seed)
    shapes = ("F({} & F({} & F {}))", "F({} & F({} & F {}))", "!{} U {}", "G !{}", "F({} & {})")
    soft: list[tuple[str, float]] = []
    for _ in range(4):
        shape = draw.choice(shapes)
        soft.append((shape.format(*(draw.choice("abc") for _ in range(shape.count("{}")))), draw.choice([0.1, 0.3, 1.0])))
    robots, team = draw.choice([(1, "own"), (2, "own"), (2, "joint"), (3, "joint")])
    assert_best(wishing(draw.choice(["F a", "true"]), *soft, robots=robots, team=team))


def test_a_soft_part_that_holds_anyway_changes_nothing() -> None:
    plain = world("F b & F c", robots=2, regions=SMALL)
    without, beside = ltlplan.plan(plain), ltlplan.plan(wishing("F b & F c", ("F b", 3.0), ("F c | F a", 1.0), robots=2))
    assert beside.robots == without.robots
    assert (beside.cost, beside.lower_bound, beside.complete) == (without.cost, without.lower_bound, without.complete)


def test_the_unit_of_weights_changes_nothing() -> None:
    first, second = (ltlplan.plan(wishing("F a", *((text, by * weight) for text, weight in SOFT))) for by in (1.0, 0.1))
    assert first.robots == second.robots


def test_a_lasso_keeps_what_it_can() -> None:
    mission = wishing("G F a", ("G F b", 1.0), ("F G a", 2.0), trace="infinite")
    assert kept_by_words(mission, ltlplan.plan(mission).words) == {1}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("also", "visits", "outcome"), [("r2", ["r1", "r2", "r1"], "holds"), ("r3", ["r1", "r3", "r1"], "fails")]
)
def test_a_published_hard_and_soft_formula(also: str, visits: list[str], outcome: str) -> None:
    made = ltlplan.plan(loads(also))
    assert [visit.region for visit in made.robots["turtle"].visits] == visits
    certificate = certified_team(made).certificate
    assert certificate.holds
    assert [part.outcome for part in certificate.soft] == [outcome]


def test_what_is_given_up_is_said_with_what_keeping_it_would_cost() -> None:
    made = ltlplan.plan(wishing("F a & G !b", ("F c", 2.0), ("G !c", 1.0), ("F b", 5.0)))
    assert made.notes[-3:] == (
        "Planned words keep weight 2 of 8 of the soft parts.",
        "Given up: `G !c` (weight 1); keeping it would give up `F c` (weight 2).",
        "Given up: `F b` (weight 5); it cannot be kept beside the formula.",
    )


@pytest.mark.slow
def test_the_judge_reads_soft_parts_from_the_mission(tmp_path: Path) -> None:
    text = mission_to_yaml(wishing("F a", ("F b", 2.0), ("G !b", 1.0)))
    result = ltlplan.run(parse_mission(text.replace("[-20.0, -20.0", "[-3.0, -3.0")), out=tmp_path / "run")
    assert [(part.formula, part.weight, part.outcome) for part in result.certificate.soft] == [
        ("F b", 2.0, "holds"), ("G !b", 1.0, "fails"),
    ]  # fmt: skip
    assert result.certificate.holds
    assert result.certificate.soft_weight == 2.0
    assert [event.sentence for event in result.log.events if event.kind == "soft"] == [
        "soft part `F b` (weight 2): the flown path satisfies it.",
        "soft part `G !b` (weight 1): the flown path does not satisfy it.",
    ]
    assert result.log.satisfied
    written = json.loads((tmp_path / "run" / "certificate.json").read_text())
    assert [part["verdict"] for part in written["soft"]] == ["holds", "fails"]
    assert "Soft parts" in (tmp_path / "run" / "report.html").read_text()
    recheck(tmp_path / "run")
    lying = {**written, "soft": [{**part, "verdict": "holds"} for part in written["soft"]]}
    (tmp_path / "run" / "certificate.json").write_text(json.dumps(lying))
    with pytest.raises(NotCertified, match="soft part 1"):
        recheck(tmp_path / "run")
    (tmp_path / "run" / "certificate.json").write_text(json.dumps({k: v for k, v in written.items() if k != "soft"}))
    with pytest.raises(NotCertified, match="lists 0 soft parts; the files give 2"):
        recheck(tmp_path / "run")


@pytest.mark.slow
def test_a_soft_part_that_no_flight_can_keep_is_reported_and_the_rest_is_certified(pace: float | str) -> None:
    once = "F c & G(c -> (c U G !c))"  # at the edge a robot may dither within its margin
    mission = wishing("F a", ("F b", 1.0), (once, 4.0))
    made = ltlplan.plan(mission, pace=pace)
    assert kept_by_words(mission, made.words) == {0, 1}
    done = certified_team(made)
    assert done.certificate.holds
    assert [part.outcome for part in done.certificate.soft] == ["holds", "fails"]
    assert done.certificate.soft_weight == 1.0
    assert f"`{once}` (weight 4) is not kept" in soft_sentences(done.certificate)[1]


@pytest.mark.slow
def test_soft_parts_for_which_there_is_no_room_in_the_air_are_given_up() -> None:
    places = {**SMALL, "d": (2.25, 1.5)}
    plain = world("F b", robots=2, regions=places, radii={"c": 0.1, "d": 0.1}, team="joint")
    soft = [{"formula": "F(c & d)", "weight": 1.0}, {"formula": "F a", "weight": 2.0}]
    made = ltlplan.plan(plain.changed(spec={**plain.spec.model_dump(), "soft": soft}))
    assert "Planned words keep weight 3 of 3 of the soft parts." in made.notes
    done = certified_team(made)  # robots in c and d are nearer than their separation
    assert done.certificate.holds
    assert [part.outcome for part in done.certificate.soft] == ["fails", "holds"]
    assert any(note.startswith("A plan that keeps more of the soft parts was given up: ") for note in done.plan.notes)


def test_soft_counts_for_which_a_region_is_too_small_are_not_planned() -> None:
    made = ltlplan.plan(wishing("F b", ("F(count(c) >= 2)", 1.0), ("F a", 2.0), robots=2, team="joint"))
    assert made.notes[-1] == "Given up: `F(count(c) >= 2)` (weight 1); it cannot be kept beside the formula."


@pytest.mark.slow
def test_robots_wait_for_a_soft_part_as_for_the_formula() -> None:
    places = {"a": (-1.0, -1.0), "b": (-1.0, 1.0), "c": (1.0, -1.0), "d": (1.0, 1.0)}
    starts = ((-1.0, -2.0), (1.0, -2.0))
    plain = world("F(a & F b) & F(c & F d)", robots=2, team="joint", regions=places, starts=starts)
    mission = plain.changed(spec={**plain.spec.model_dump(), "soft": [{"formula": "G !(a & c)"}]})
    done = certified_team(ltlplan.plan(mission))
    assert [part.outcome for part in done.certificate.soft] == ["holds"]
    assert done.plan.precedences
    assert done.rounds > 1


@few_of(3, "weight", ["0", "-1", ".nan", ".inf", "heavy"])
def test_weights_are_above_zero_and_finite(weight: str) -> None:
    text = mission_to_yaml(wishing("F a", ("F b", 2.0))).replace("weight: 2.0", f"weight: {weight}")
    with pytest.raises(BadInput, match=r"spec\.soft\.0\.weight"):
        parse_mission(text)


def test_soft_parts_name_what_there_is() -> None:
    text = mission_to_yaml(wishing("F a", ("F b", 2.0)))
    with pytest.raises(BadInput, match=r"spec\.soft\.0\.formula: 'bb' is not a name of this mission\. Did you mean 'b'\?"):
        parse_mission(text.replace("F b", "F bb"))
    with pytest.raises(BadInput, match=r"spec\.soft\.0\.formula: missing"):
        parse_mission(text.replace("formula: F b, ", ""))


def test_soft_parts_count_robots_where_the_formula_may() -> None:
    text = mission_to_yaml(wishing("F a", ("F b", 2.0), robots=2)).replace("formula: F b", 'formula: "F(count(b) >= 2)"')
    with pytest.raises(BadInput, match=r"spec\.soft\.0\.formula: .*count"):
        parse_mission(text)
    joint = parse_mission(text.replace("team: own", "team: joint"))
    assert joint.asking(joint.soft_parts[0].formula).formula.names() <= {"b", "quad0.b", "quad1.b"}


def test_missions_without_soft_parts_read_as_before() -> None:
    assert "soft" not in mission_to_yaml(world("F a"))


@few_of(
    1,
    ("formula", "left_out"),
    [
        ("F a & G !a & F b", ("F a",)),
        ("F a & F b & G !(a | b) & F c", ("F b", "G !a")),  # straight through a is shorter than around it
        ("F a & G !a & F b & G !b", ("F a", "F b")),
    ],
)
def test_an_impossible_formula_comes_with_its_cheapest_relaxation(formula: str, left_out: tuple[str, ...]) -> None:
    with pytest.raises(NoPlan) as found:
        assign(world(formula, regions=SMALL))
    assert found.value.left_out == left_out
    shown = " and ".join(f"`{part}`" for part in left_out)
    assert f"The cheapest relaxation leaves out {shown} (weight {len(left_out)}): the rest can be planned." in str(found.value)


@pytest.mark.slow
def test_eight_soft_parts_of_a_team_are_planned() -> None:
    regions = {name: (1.3 * (i % 4), 1.4 * (i // 4)) for i, name in enumerate("abcdefgh")}
    soft = [{"formula": f"F {x}" if i % 2 else f"G !{x}", "weight": 1.0 + i} for i, x in enumerate("abcdefgh")]
    plain = world("F a & F(c & F h) & (!d U e)", robots=3, regions=regions)
    made = ltlplan.plan(plain.changed(spec={**plain.spec.model_dump(), "soft": soft}))
    assert any("of the soft parts" in note for note in made.notes)


def in_turn_only(formula: str, *soft: str) -> Mission:
    """Return a mission in which one robot serves a and b, the other c and d."""
    plain = own_places(formula, {"quad0": "ab", "quad1": "cd"}, starts=((0.0, 0.0), (3.0, 3.0)))
    parts = [{"formula": text, "weight": 1.0} for text in soft]
    return plain.changed(spec={**plain.spec.model_dump(), "soft": parts})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formula", "soft"),
    [
        ("F a & F b & F c & F d", ("G(a -> (!c U b))", "G(c -> (!a U d))")),  # the flight is certified, and does not keep both
        pytest.param(
            "F a & F b & F c & G(a -> (!c U b)) & G(c -> (!a U d))", ("F d",), marks=pytest.mark.slow
        ),  # it is refused
    ],
)
def test_other_words_are_tried_before_a_soft_part_is_given_up(formula: str, soft: tuple[str, ...]) -> None:
    """Each order of the robots does it; but b may be read late, so no flight of these words does unless quad0 leaves b."""
    made = ltlplan.plan(in_turn_only(formula, *soft))
    assert not made.precedences
    done = certified_team(made)
    assert done.rounds == 2
    assert done.certificate.soft_weight == len(soft)
    assert done.plan.words != made.words
    assert [each.sentence(done.plan.robots) for each in done.plan.precedences] == ["quad1 enters c only when quad0 has left b"]
    kept = f"Planned words keep weight {len(soft)} of {len(soft)} of the soft parts."
    assert done.plan.notes[-2] == kept
    assert "were given up for words that keep them under precedences" in done.plan.notes[-1]
    assert done.plan.mission == made.mission


@pytest.mark.slow
def test_what_was_found_for_a_choice_of_parts_is_what_is_planned() -> None:
    mission = wishing("F a", ("F(b & F c)", 1.0), ("F(c & F b)", 1.0), robots=2)
    made, asked = ltlplan.plan(mission), mission.asking("(F a) & (F(b & F c)) & (F(c & F b))")
    assert made.words == ltlplan.plan(asked).words
    assert made.cost == ltlplan.plan(asked).cost


CLASHING = ("F a", "G !a", "F b", "G !b", "!b U a", "!a U b", "F c & G !b", "F(b & F c)", "G(a -> F b)")


def assert_cheapest_relaxation(seed: int) -> bool:
    """Hold what an impossible formula is told to leave out against all sets of its parts."""
    draw = random.Random(seed)
    parts, robots = draw.sample(CLASHING, 4), draw.choice((1, 2))
    mission = world(" & ".join(f"({part})" for part in parts), robots=robots, regions=SMALL, team=draw.choice(("own", "joint")))
    try:
        assign(mission)
    except NoPlan as error:
        left_out = error.left_out
    else:
        return False
    written = list(dict.fromkeys(str(part) for part in mission.written.conjuncts()))
    costs: dict[frozenset[str], float] = {}
    for those in (those for size in range(1, len(written)) for those in itertools.combinations(written, size)):
        with contextlib.suppress(Unsatisfiable):
            costs[frozenset(those)] = assign(mission.asking(" & ".join(f"({part})" for part in those)), explained=False).cost
    size, least = min((len(written) - len(those), cost) for those, cost in costs.items())
    assert len(left_out) == size
    assert costs[frozenset(written) - set(left_out)] == pytest.approx(least)
    return True


def test_no_relaxation_is_cheaper_than_the_one_that_is_offered() -> None:
    assert sum(assert_cheapest_relaxation(seed) for seed in range(3)) > 0


@pytest.mark.slow
@pytest.mark.parametrize("block", range(3))
def test_of_many_impossible_formulas_none_has_a_cheaper_relaxation(block: int) -> None:
    assert sum(assert_cheapest_relaxation(seed) for seed in range(100 * (block + 1), 100 * (block + 1) + 30)) > 10
