"""Every word of every robot is a trace of its A = E x R: environment times internal states (2022 paper, Def. 4.3).

Regions entered one after another must be joined by an edge (coming back to the region just left is allowed), and the
internal state may change only by the mission's actions, inside the region that permits each. A word on which two
regions are entered at one instant is read in each order that the regions allow, and in every order where they allow none, as of two
regions that are one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from verify.data.language.word import show_letter
from verify.data.mission import Mission
from verify.data.sections import Environment
from verify.logic.progression import OutOfBudget
from verify.logic.verdict import Verdict
from verify.model_checking.robot_letters import RobotBehaviour, from_timeline
from verify.model_checking.timeline import Relations, Timeline

_State = tuple[int, frozenset[str], str]  # node, vertices of E that the robot may be taken to be at, internal state


def judge_transitions(mission: Mission, timelines: Mapping[str, Timeline], relations: Relations) -> list[Verdict]:
    """Decide for each robot whether all its words are traces of its transition system.

    Args:
        mission: Carries the transition system, and where each robot begins.
        timelines: One for each robot to be checked.
        relations: What is proved of the regions at large.

    Returns:
        One verdict for each timeline, for the claim "transitions".
    """
    return [_judge(mission, timeline, relations) for timeline in timelines.values()]


def no_word_is_a_trace(mission: Mission, timeline: Timeline, relations: Relations) -> bool:
    """Return whether each word of a robot breaks its transition system, whatever the timeline leaves open.

    False means only that this was not proved.

    Args:
        mission: Carries the transition system, and where each robot begins.
        timeline: What is known of one robot.
        relations: What is proved of the regions at large.
    """
    if timeline.internal != mission.initial_letter(timeline.robot):
        return True
    try:
        robot = from_timeline(timeline, relations)
    except OutOfBudget:
        return False
    return not _Search(mission, timeline, relations, robot).some_trace()


@dataclass(frozen=True)
class _Fault:
    sentence: str
    region: str | None


def _judge(mission: Mission, timeline: Timeline, relations: Relations) -> Verdict:
    name = timeline.robot
    if timeline.internal != mission.initial_letter(name):
        return _fails(
            name, f"{name} starts with {show_letter(timeline.internal)}, not {show_letter(mission.initial_letter(name))}."
        )
    try:
        robot = from_timeline(timeline, relations)
    except OutOfBudget as error:
        return Verdict("undecided", f"{name}'s transitions could not be decided: {error}.", claim="transitions", robot=name)
    search = _Search(mission, timeline, relations, robot)
    found = search.run()
    if found is not None:
        return found
    return Verdict("holds", f"Every word of {name} is a trace of its transition system.", claim="transitions", robot=name)


class _Search:
    """Breadth first over the robot's graph, with where it came from and its internal state."""

    def __init__(self, mission: Mission, timeline: Timeline, relations: Relations, robot: RobotBehaviour) -> None:
        self.mission = mission
        self.timeline = timeline
        self.relations = relations.among({*timeline.initial, *(change.region for change in timeline.changes)})
        self.robot = robot
        self.system = mission.robot_of(robot.robot)
        self.environment = mission.environment
        self.edges = None if mission.environment is None else _edges(mission.environment, mission.kind_of(robot.robot))
        self.start = "" if mission.environment is None else mission.environment.start
        self.before = mission.agents[robot.robot].visited or self.start
        self.all_regions = frozenset(mission.all_regions)
        self.closed = frozenset(r for r in self.all_regions if not mission.may_enter(robot.robot, r))
        self.regions = [letter & self.all_regions for letter in robot.letters]

    def run(self) -> Verdict | None:
        """Return how some word breaks the system, or None."""
        came = self._begin()
        for state in came:
            if begun := sorted(self.closed & self.regions[state[0]]):
                return self._failure(
                    came, state, state[0], _Fault(f"{self.robot.robot} can begin in {begun[0]}, closed to it", begun[0])
                )
        queue = deque(came)
        while queue:
            state = queue.popleft()
            for fault, after in self._moves(state):
                if fault is not None:
                    return self._failure(came, state, after[0], fault)
                if after not in came:
                    came[after] = state
                    queue.append(after)
        return None

    def some_trace(self) -> bool:
        """Return whether some word, from beginning to end, keeps the system."""
        queue = deque(state for state in self._begin() if not self.closed & self.regions[state[0]])
        seen = set(queue)
        while queue:
            state = queue.popleft()
            if state[0] in self.robot.final:
                return True
            allowed = {after for fault, after in self._moves(state) if fault is None}
            queue.extend(allowed - seen)
            seen |= allowed
        return False

    def _begin(self) -> dict[_State, _State | None]:
        internal = self.mission.initial_internal(self.robot.robot)
        return {
            (node, frozenset({vertex}), internal): None
            for node in self.robot.initial
            for vertex in sorted(self.regions[node]) or [self.before]
        }

    def _moves(self, state: _State) -> Iterator[tuple[_Fault | None, _State]]:
        node, vertices, internal = state
        for target in self.robot.following[node]:
            entered = self.regions[target] - self.regions[node]
            done = 0 if (node, target) in self.robot.laps else self.robot.actions[target] - self.robot.actions[node]
            if (entered and done) or done > 1 or (len(entered) > 1 and self._is_walked_in_steps(node, target)):
                continue  # the same in smaller steps is followed as well
            if entered:
                for fault, region in self._entries(node, vertices, entered):
                    yield fault, (target, frozenset({region}), internal)
            elif done:
                fault, reached = self._action(self.robot.actions[node], node, target, internal)
                yield fault, (target, vertices, reached)
            else:
                yield None, (target, vertices | self._gone_back(state, target), internal)

    def _is_walked_in_steps(self, node: int, target: int) -> bool:
        """Return whether the regions that are entered between two nodes can be entered in an order, too: relations may leave out all of them."""
        before, after = self.regions[node], self.regions[target]
        return any(
            before < self.regions[between] < after and target in self.robot.following[between]
            for between in self.robot.following[node]
        )

    def _entries(self, node: int, vertices: frozenset[str], entered: frozenset[str]) -> Iterator[tuple[_Fault | None, str]]:
        """Yield how regions are entered one after another at one instant: what breaks it, and the region entered last."""
        begun = (frozenset[str](), vertices)
        queue, seen = deque([begun]), {begun}
        while queue:
            over, came = queue.popleft()
            here = [one for one in entered - over if self.relations.allows(self.regions[node] | over | {one})]
            for region in sorted(here or entered - over):
                fault, after = self._entry(node, came, region), (over | {region}, frozenset({region}))
                if fault is not None or after[0] == entered:
                    yield fault, region
                elif after not in seen:
                    seen.add(after)
                    queue.append(after)

    def _gone_back(self, state: _State, target: int) -> frozenset[str]:
        """Return the regions that a robot still is in and has gone back to along an edge, by leaving the region that it came to last."""
        node, vertices, _ = state
        left = vertices & (self.regions[node] - self.regions[target])
        if self.edges is None or not left:
            return frozenset()
        return frozenset(region for region in self.regions[target] for vertex in left if region in self.edges.get(vertex, ()))

    def _entry(self, node: int, vertices: frozenset[str], region: str) -> _Fault | None:
        if region in self.closed:
            only = " and ".join(self.mission.all_regions[region].only or ())
            return _Fault(f"{self.robot.robot} can enter {region}, which is open to {only} only", region)
        if self.edges is None or any(region == vertex or region in self.edges.get(vertex, ()) for vertex in vertices):
            return None
        vertex = min(vertices, key=lambda name: (name not in self.regions[node], name))
        before = f"its start ({vertex})" if vertex == self.start else vertex
        reachable = sorted(self.edges.get(vertex, ()))
        sentence = f"{self.robot.robot} can enter {region} straight from {before}, which no edge of the environment joins"
        missed = self._missed(vertex, region, node)
        if missed is not None:
            sentence += f": it may miss {missed} on the way, which it is not sure to enter"
        sentence += f". From {before} it may go to {', '.join(reachable) or 'nowhere'}."
        return _Fault(sentence, region)

    def _missed(self, vertex: str, region: str, node: int) -> str | None:
        """Return a region between the two that the robot only may have been in."""
        assert self.edges is not None
        until = self.robot.spans[node][1]
        for change in reversed(self.timeline.changes):
            between = change.region in self.edges.get(vertex, ()) and region in self.edges.get(change.region, ())
            if change.status == "may" and between and change.time.low <= until:
                return change.region
        return None

    def _action(self, number: int, node: int, target: int, internal: str) -> tuple[_Fault | None, str]:
        action = self.timeline.actions[number]
        what = f"{self.robot.robot}'s action {action.source} -> {action.target}"
        allowed = [a for a in self.system.actions if (a.source, a.target) == (action.source, action.target)]
        if action.target not in self.system.states:
            return _Fault(f"{what} leads to a state that the robot does not have.", action.at), internal
        propositions = frozenset(self.system.states[action.target])
        if action.source != internal:
            return _Fault(f"{what} is made in state {internal}.", action.at), internal
        if action.at not in [a.at for a in allowed]:
            places = ", ".join(a.at for a in allowed) or "nowhere"
            return _Fault(f"{what} is made at {action.at}; it is permitted at: {places}.", action.at), internal
        if action.propositions != propositions:
            return _Fault(
                f"{what} gives {show_letter(action.propositions)}, but {action.target} has {show_letter(propositions)}.",
                action.at,
            ), internal
        if action.at not in self.regions[node] or action.at not in self.regions[target]:
            return _Fault(f"{what} can happen outside {action.at}, the only place where it is permitted.", action.at), internal
        return None, action.target

    def _failure(self, came: dict[_State, _State | None], state: _State, target: int, fault: _Fault) -> Verdict:
        nodes = [target]
        at: _State | None = state
        while at is not None:
            nodes.append(at[0])
            at = came[at]
        nodes.reverse()
        kept = [n for i, n in enumerate(nodes) if i == 0 or self.robot.letters[n] != self.robot.letters[nodes[i - 1]]]
        spans = [(float(self.robot.spans[n][0]), float(self.robot.spans[n][1])) for n in kept]
        visits = -1
        for i, node in enumerate(kept):
            visits += len(self.regions[node] - (self.regions[kept[i - 1]] if i else frozenset()))
        when = self.robot.spans[nodes[-1]][0]
        return Verdict(
            "fails",
            f"{fault.sentence} (at {float(when):.3f} s)",
            tuple((self.robot.robot, self.robot.letters[n]) for n in kept),
            float(when),
            claim="transitions",
            robot=self.robot.robot,
            visit=max(visits, 0),
            region=fault.region,
            times=tuple(spans),
        )


def _edges(environment: Environment, kind: str | None) -> dict[str, set[str]]:
    edges: dict[str, set[str]] = {}
    for source, target in environment.open_to(kind):
        edges.setdefault(source, set()).add(target)
        if not environment.directed and source != environment.start:
            edges.setdefault(target, set()).add(source)
    for targets in edges.values():
        targets.discard(environment.start)  # left, never entered
    return edges


def _fails(robot: str, sentence: str) -> Verdict:
    return Verdict("fails", sentence, claim="transitions", robot=robot)
