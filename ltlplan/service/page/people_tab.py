"""The last tab, for those who logged in: one's own account and tokens, projects, and for admins all accounts and the log."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from nicegui import ui

from ltlplan.service.page.elements import Part, Words, box, button, submitted, table
from ltlplan.service.people.administration import Administration
from ltlplan.service.people.audit_log import LogQuery
from ltlplan.service.people.roles import Action, Role
from ltlplan.service.people_models import Secret

if TYPE_CHECKING:
    from nicegui.element import Element

    from ltlplan.service.page.session_state import Desk
    from ltlplan.service.people_models import AccountTold, LogEntry, Project, Webhook, WhoAmI

Found = TypeVar("Found")
_LOGGED = 50
"""Entries of the log that are shown."""
_NO_TOKENS = "You have no tokens. Programs ask by one: ltlplan.Client(address, token=...)."
_NO_PROJECTS = "There is none yet. Jobs are yours alone until you put them into a project and share it."


class _People:
    """The tab while it is used."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.office = Administration(desk.service.people, desk.principal, desk.session)
        self.typed: dict[str, str] = {}
        with box("people"):
            self.secret = Part(box("secret").props("role=status"))
            self.own = Part(box("own", tag="section").props('aria-label="Your account"'))
            self.projects = Part(box("projects", tag="section").props('aria-label="Projects"'))
            self.webhooks = Part(box("webhooks", tag="section").props('aria-label="Webhooks"'))
            self.accounts = Part(box("accounts", tag="section").props('aria-label="Accounts"'))
            self.log = Part(box("log", tag="section").props('aria-label="Log"'))
        desk.on_tab.append(lambda tab: self.timer.activate() if tab == "people" else None)
        self.timer = ui.timer(0.0, self.refresh, active=False, once=False)

    async def refresh(self) -> None:
        """Look again at who there is."""
        self.timer.deactivate()
        await self.desk.guarded(self._look(), self.own.place)

    async def _look(self) -> None:
        office = self.office
        who, projects = await asyncio.to_thread(office.who), await asyncio.to_thread(office.projects)
        self.own.show(who, lambda: self._own(who))
        self.projects.show(projects, lambda: self._projects(projects))
        if self.desk.may(Action.PLAN) and self.desk.service.sender.allowed.hosts:
            webhooks = await asyncio.to_thread(self.desk.service.people.webhooks.listed, self.desk.principal)
            self.webhooks.show(webhooks, lambda: self._webhooks(webhooks))
        if self.desk.may(Action.ADMINISTER):
            accounts = await asyncio.to_thread(office.accounts)
            log = await asyncio.to_thread(office.log, LogQuery(limit=_LOGGED))
            self.accounts.show(accounts, lambda: self._accounts(accounts))
            self.log.show(log, lambda: _log(log))

    def _own(self, who: WhoAmI) -> None:
        Words("h2", f"You are {who.user}, {who.role}")
        with box("row"):
            Words("a", "Change your password", "button").props("href=/password")
            button("Log out everywhere else", lambda: self._do(self.office.end_own_sessions), "quiet")
        Words("h3", "Your tokens")
        if not who.tokens:
            Words("p", _NO_TOKENS, "soft")
        with box(tag="ul"):
            for name in who.tokens:
                with box("row", tag="li"):
                    Words("code", name)
                    button(
                        "Revoke", lambda name=name: self._do(self.office.revoke_token, name), "quiet", label=f"Revoke {name}"
                    )
        self._form(
            "A new token, called", "label", "Make it", lambda: self._reveal(self.office.new_token, self.typed.get("label", ""))
        )

    def _projects(self, projects: tuple[Project, ...]) -> None:
        Words("h2", "Projects")
        if not projects:
            Words("p", _NO_PROJECTS, "soft")
        with box("scroll"), box(tag="table"), box(tag="tbody"):
            for each in projects:
                with box(tag="tr"):
                    Words("td", each.name)
                    Words("td", f"{each.jobs} job{'' if each.jobs == 1 else 's'}", "number")
                    Words("td", "shared with all" if each.shared else "private", "soft")
                    Words("td", f"{each.owner}'s" if each.owner else "", "soft")
                    with box(tag="td"):
                        if self.desk.may(Action.ADMINISTER) or each.owner == self.desk.user:
                            words = "Make private" if each.shared else "Share"
                            act = lambda each=each: self._do(self.office.share, each.name, not each.shared)  # noqa: E731
                            button(words, act, "quiet", label=f"{words}: {each.name}")
        if self.desk.may(Action.PLAN):
            self._form(
                "A new project, called",
                "project",
                "Make it",
                lambda: self._do(self.office.share, self.typed.get("project", ""), False),
            )

    def _webhooks(self, webhooks: tuple[Webhook, ...]) -> None:
        kept, who, hosts = self.desk.service.people.webhooks, self.desk.principal, self.desk.service.sender.allowed.hosts
        Words("h2", "Webhooks")
        Words("p", f"Addresses that hear of the ends of your jobs: id and state, signed. Hosts: {', '.join(hosts)}.", "soft")
        if not webhooks:
            Words("p", "None yet. Add an address of a listed host.", "soft")
        with box("scroll"), box(tag="table"), box(tag="tbody"):
            for each in webhooks:
                with box(tag="tr"):
                    Words("td", each.url)
                    Words("td", each.said or "nothing sent yet", "soft")
                    with box(tag="td"):
                        act = lambda each=each: self._do(kept.delete, who, each.id)  # noqa: E731
                        button("Delete", act, "quiet", label=f"Delete {each.url}")

        def added() -> Secret:
            made, secret = kept.add(who, self.typed.get("webhook", ""), hosts)
            return Secret(name=made.url, secret=secret)

        self._form("A new address", "webhook", "Add it", lambda: self._reveal(added))

    def _accounts(self, accounts: tuple[AccountTold, ...]) -> None:
        Words("h2", "Accounts")
        with box("scroll"), box(tag="table"), box(tag="tbody"):
            for each in accounts:
                with box(tag="tr"):
                    Words("td", each.name)
                    with box(tag="td"):
                        self._roles(
                            f"Role of {each.name}",
                            each.role,
                            lambda role, each=each: self._do(self.office.set_role, each.name, role),
                        )
                    state = (
                        "disabled"
                        if each.disabled
                        else "has a temporary password"
                        if each.temporary
                        else f"{each.sessions} logged in"
                    )
                    Words("td", state, "soft")
                    with box(tag="td"), box("row"):
                        if each.issuer is None:
                            button(
                                "Reset password",
                                lambda each=each: self._reveal(self.office.reset_password, each.name),
                                "quiet",
                                label=f"Reset password of {each.name}",
                            )
                        button(
                            "Log out",
                            lambda each=each: self._do(self.office.end_sessions, each.name),
                            "quiet",
                            label=f"Log out {each.name}",
                        )
                        words = "Enable" if each.disabled else "Disable"
                        act = lambda each=each: self._do(self.office.set_disabled, each.name, each.disabled is None)  # noqa: E731
                        button(words, act, "quiet" if each.disabled else "quiet danger", label=f"{words} {each.name}")
        self.typed["role"] = Role.planner.name
        add = lambda: self._reveal(self.office.add_account, self.typed.get("account", ""), self.typed["role"])  # noqa: E731
        with self._form("A new account, called", "account", "Make it", add):
            self._roles("Its role", Role.planner.name, lambda role: self.typed.update(role=role))

    def _roles(self, label: str, chosen: str, act: Callable[[str], object]) -> None:
        with ui.element("select").classes("role") as select:
            select.props["aria-label"] = label
            for role in Role:
                option = Words("option", role.name).props(f"value={role.name}")
                if role.name == chosen:
                    option.props("selected")
        select.on("change", lambda event: act(str(event.args)), js_handler="(event) => emit(event.target.value)")

    def _form(self, label: str, key: str, words: str, act: Callable[[], object]) -> Element:
        """Show a field and a button; what more is put into it stands between the two."""
        self.typed[key] = ""

        def typed(event: Any) -> None:  # of any type: NiceGUI's events carry what the browser sends
            self.typed[key] = str(event.args).strip()

        with box("row", tag="form") as form:
            with box(tag="label"):
                Words("span", f"{label} ")
                field = ui.element("input").props(f"name={key} autocomplete=off maxlength=500 autocapitalize=none")
                field.on("input", typed, js_handler="(event) => emit(event.target.value)")
            between = box("between")
            button(words, lambda: None).props("type=submit")
        submitted(form, lambda _event: act())
        return between

    async def _do(self, work: Callable[..., object], *arguments: object) -> None:
        """Do something, and show what there is then."""

        async def done() -> None:
            await asyncio.to_thread(work, *arguments)
            self.secret.show(None, lambda: None)
            await self._look()

        await self.desk.guarded(done(), self.own.place)

    async def _reveal(self, work: Callable[..., Secret], *arguments: object) -> None:
        """Do something, and show the secret that it made: once."""

        async def done() -> None:
            made = await asyncio.to_thread(work, *arguments)
            self.secret.show(made, lambda: _secret(made))
            await self._look()

        await self.desk.guarded(done(), self.own.place)


def _secret(made: Secret) -> None:
    Words("p", f"Of {made.name}, shown this once:")
    Words("code", made.secret, "revealed")


def _log(entries: tuple[LogEntry, ...]) -> None:
    Words("h2", "Who did what")
    rows = [(each.time[:19].replace("T", " "), each.user, each.role, each.action, each.object, each.detail) for each in entries]
    table(("UTC", "who", "role", "did", "to", "more"), rows)


def people_tab(desk: Desk) -> None:
    """Make the tab; one person on one machine has none.

    Args:
        desk: What the person has open.
    """
    if desk.user is not None:
        _People(desk)
