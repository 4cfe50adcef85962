"""The first tab: a mission is written, with faults underlined where they are, its formula in words and its automata beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from nicegui import ui

from ltlplan.missions import shipped_mission_text, shipped_missions, template_text
from ltlplan.service.page.comparison.varying import begin_study
from ltlplan.service.page.components import Editor, World
from ltlplan.service.page.elements import Words, box, button, say
from ltlplan.service.page.missions import checking
from ltlplan.service.page.missions.drafted import Drafted
from ltlplan.service.page.missions.stored import Stored
from ltlplan.service.people.roles import Action
from verify.data import LtlplanError, MissionError

if TYPE_CHECKING:
    from ltlplan.service.page.session_state import Desk

FIRST = "firefighting"
_BLANK = "a blank mission"
_KINDS = {"hoop": "Places", "region": "Places", "in no region": "Places", "internal state": "States"}
"""What names are, as they are listed."""


class _Writing:
    """The tab while it is used."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.newest = 0
        self.faults: list[dict[str, Any]] = []
        with box("gallery"):
            stored, drafts = box("stored"), box("drafts")
            Words("span", "Start from", "soft")
            for name in (*shipped_missions(), _BLANK):
                button(name, lambda name=name: self.start_from(name), "quiet")
        with box("writing"):
            with box("mission"):
                self.editor = Editor("The mission, as YAML", language="YAML", on_text=self.typed, on_submit=self.submit)
                with box("state").props("role=status aria-live=polite"):
                    self.state = Words("span", "")
                    self.listed = box("faults", tag="ul")
                with box("submit"):
                    self.go = button("Plan it", self.submit, "primary")
                    self.go.set_visibility(desk.may(Action.PLAN))
                    if desk.may(Action.PLAN):
                        button("Study ...", self._study, label="Study this mission over seeds or values of a key")
                    with box(tag="label"):
                        Words("span", "seed")
                        self.seed = ui.element("input").props("type=number min=0 step=1 inputmode=numeric").classes("seed")
                        self.seed_text = ""
                        self.seed.on("input", self._seed_typed, js_handler="(event) => emit(event.target.value)")
                    with box(tag="label"):
                        Words("span", "pace")
                        self.pace = (
                            ui.element("input").props('type=text inputmode=decimal placeholder="as written"').classes("seed")
                        )
                        self.pace_text = ""
                        self.pace.on("input", self._pace_typed, js_handler="(event) => emit(event.target.value)")
                    Words("span", "Ctrl-Enter in the editor plans, too.", "soft hint")
                self.stored = Stored(desk, lambda: self.editor.text, self.write)
                self.stored.draw_saving()
            with drafts:
                self.drafted = Drafted(desk, self.editor, self._open_draft)
            with stored:
                self.stored.draw_list()
            with box("beside"):
                Words("h2", "World")
                self.world = World("3-D picture of the mission's regions and starts")
                Words("h2", "Formula")
                self.formula = Editor(
                    "The formula", single=True, hint="such as F loc1 & G(smoke -> carrying)", on_text=self.formula_typed
                )
                self.words = box("words", tag="ul")
                self.names = box("names")
                self.automata = ui.html("", sanitize=True).classes("automata")

    def _study(self) -> None:
        begin_study(self.desk, lambda: self.editor.text, lambda: self.pace_text)

    def _seed_typed(self, event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
        self.seed_text = str(event.args).strip()

    def _pace_typed(self, event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
        self.pace_text = str(event.args).strip()

    async def start_from(self, name: str) -> None:
        """Begin with a shipped mission, or with a blank one; what was written stays among the drafts."""
        text = template_text("my-mission", alone=True) if name == _BLANK else shipped_mission_text(name)
        self.drafted.begin()
        self.stored.close()
        await self.show(text, own=False)

    async def write(self, text: str) -> None:
        """Begin another draft with a text; what was written stays among the drafts."""
        self.drafted.begin()
        self.stored.close()
        await self.show(text)

    async def _open_draft(self, text: str) -> None:
        self.stored.close()
        await self.show(text)

    async def show(self, text: str, *, own: bool = True) -> None:
        """Show a text, and check it.

        Args:
            text: The text.
            own: Whether it is this person's, and to be kept like what they write.
        """
        self.editor.put(text, own=own)
        await self.typed(text)

    async def restore(self) -> None:
        """Show what was written last, or a shipped mission."""
        text, own = await self.drafted.restore()
        if text is None:
            await self.show(shipped_mission_text(FIRST), own=False)
        else:
            await self.show(text, own=own)

    async def typed(self, text: str) -> None:
        """Say of a text what there is to say; of several under way the newest counts."""
        self.newest += 1
        number = self.newest
        self.state.set_text("checking ...")
        try:
            told = await self.desk.service.questions.ask(checking.check_text, text, who=self.desk.who)
        except LtlplanError as error:
            self.state.set_text(str(error))
            return
        if number == self.newest:
            self._tell(told)

    async def formula_typed(self, formula: str) -> None:
        """Write the formula into the mission."""
        await self.desk.guarded(self._change_formula(formula), self.words)

    async def _change_formula(self, formula: str) -> None:
        self.newest += 1  # what was asked before says nothing of what is written now
        number = self.newest
        text = await self.desk.service.questions.ask(checking.change_formula, self.editor.text, formula, who=self.desk.who)
        if number != self.newest:
            return
        self.editor.put(text)
        await self.typed(text)

    def _tell(self, told: dict[str, Any]) -> None:
        self.faults = told["faults"]
        self.editor.underline(self.faults)
        self.formula.underline(_within(self.faults, told.get("formula")))
        if told.get("formula") is not None:
            self.formula.put(told["formula"])
        self._list_faults()
        self.go.props(remove="disabled") if not self.faults else self.go.props("disabled")
        if self.faults:
            return
        robots = "1 robot" if told["robots"] == 1 else f"{told['robots']} robots"
        notes = "".join(f" Note: {note}" for note in told["notes"])
        self.state.set_text(f"No faults: {told['name']}, {robots}, {told['trace']} trace, team: {told['team']}.{notes}")
        self.formula.set_visibility(told["formula"] is not None)
        self.editor.complete(told["names"], told["operators"])
        self.formula.complete(told["names"], told["operators"])
        self.words.clear()
        with self.words:
            for sentence in told["words"] or [f"Flies exactly {told['sequence']}."]:
                Words("li", sentence)
        self.names.clear()
        with self.names:
            for kind, known in _by_kind(told["names"]):
                with box("kind"):
                    Words("span", kind, "soft")
                    for name, what in known:
                        Words("code", name).props["title"] = what
        self.automata.set_content("".join(part["svg"] or "" for part in told["automata"]))
        self.world.put(told["world"])

    def _list_faults(self) -> None:
        count = len(self.faults)
        self.state.set_text("" if not count else "1 fault" if count == 1 else f"{count} faults")
        self.listed.clear()
        with self.listed:
            for fault in self.faults:
                where = f"line {fault['line']}" if fault["line"] else "the mission"
                keys = f" {fault['keys']}:" if fault["keys"] else ":"
                with box(tag="li"):
                    button(
                        f"{where}{keys} {fault['message']}", lambda fault=fault: self.editor.reveal(fault["from"]), "fault-line"
                    )

    async def submit(self) -> None:
        """Hand the mission in, and go where it is planned."""
        with self.words:
            try:
                await self._submit()
            except MissionError:
                await self.typed(self.editor.text)
            except LtlplanError as error:
                say(error)

    async def _submit(self) -> None:
        from ltlplan.planner import pace_of, with_pace

        text, seed = self.editor.text, self.seed_text
        if seed and not seed.isdecimal():
            say(f"A seed is a whole number from 0 on, not '{seed}'.")
            return
        mission = await self.desk.service.mission(text, who=self.desk.who)
        mission = with_pace(mission, pace_of(self.pace_text or None))
        job = await self.desk.jobs.submit(mission, seed=int(seed) if seed else None)
        self.desk.texts[job.id] = text
        await self.drafted.hand_in(job.id, text)
        if job.found:
            say("This mission was planned before, with this seed and these versions; here is what was found.", good=True)
        await self.desk.open(job.id, "plan")


def _by_kind(names: dict[str, str]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return names with what they are, places apart from what internal states show and from other robots' names."""
    found: dict[str, list[tuple[str, str]]] = {}
    for name, what in names.items():
        found.setdefault(_KINDS.get(what, "Robots"), []).append((name, what))
    return list(found.items())


def _within(faults: list[dict[str, Any]], formula: str | None) -> list[dict[str, Any]]:
    """Return the formula's own faults, as they stand in it."""
    found = [fault for fault in faults if fault["keys"] == "spec.formula" and "in_formula" in fault]
    return (
        [] if formula is None else [{**fault, "from": fault["in_formula"][0], "to": fault["in_formula"][1]} for fault in found]
    )


async def write_tab(desk: Desk) -> None:
    """Make the tab.

    Args:
        desk: What the person has open.
    """
    writing = _Writing(desk)
    desk.write = writing.write
    desk.written = writing.drafted.text_of
    ui.timer(0.0, writing.restore, once=True)
