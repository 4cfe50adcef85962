"""Stored missions: versions that are never lost or changed, two who write at once, projects, tags and search."""

from __future__ import annotations

import threading

import pytest

from ltlplan.service.people.people import People
from ltlplan.service.people.roles import Principal, Role
from ltlplan.service.people.stored_missions import LONGEST
from ltlplan.service.people_models import StoredMission
from ltlplan.service.problems import Conflict, Forbidden, NotFound
from verify.data import BadInput

ALICE, BOB, EVE = Principal("alice", Role.planner), Principal("bob", Role.planner), Principal("eve", Role.viewer)
ROOT = Principal("root", Role.admin)


@pytest.fixture
def stored(people: People) -> StoredMission:
    """Return a mission of alice's with one version."""
    return people.missions.store(ALICE, "patrol", "name: patrol\nseed: 1\n", tags=("lab", "night"))


def test_every_version_stays_with_who_and_what_changed(people: People, stored: StoredMission) -> None:
    missions = people.missions
    second = missions.save(ALICE, stored.id, "name: patrol\nseed: 2\n", after=1)
    assert (second.version, second.by, second.tags) == (2, "alice", ("lab", "night"))
    assert missions.save(ALICE, stored.id, "name: patrol\nseed: 2\n", after=2).version == 2, "the same text is no version"
    assert missions.version(ALICE, stored.id, 1).text == "name: patrol\nseed: 1\n"
    assert [(each.number, each.user, each.text) for each in missions.versions(ALICE, stored.id)] == [
        (2, "alice", ""),
        (1, "alice", ""),
    ]
    changed = missions.difference(ALICE, stored.id, 1, 2).splitlines()
    assert [line for line in changed if line[:1] in "+-" and line[:3] not in ("+++", "---")] == ["-seed: 1", "+seed: 2"]
    assert missions.difference(ALICE, stored.id, 2, 2) == ""
    assert "+name: patrol" in missions.difference(ALICE, stored.id, 0, 1)
    with pytest.raises(NotFound, match="no version 3"):
        missions.version(ALICE, stored.id, 3)


def test_of_two_who_save_at_once_one_is_told(people: People, stored: StoredMission) -> None:
    done: list[str] = []

    def save(text: str) -> None:
        try:
            people.missions.save(ALICE, stored.id, text, after=1)
            done.append("saved")
        except Conflict as error:
            done.append(str(error))

    threads = [threading.Thread(target=save, args=(f"seed: {i}",)) for i in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(done) == ["alice saved version 2 meanwhile."] * 5 + ["saved"]


def test_what_is_private_is_not_there_for_others_and_what_is_shared_all_planners_write(
    people: People, stored: StoredMission
) -> None:
    missions = people.missions
    for ask in (
        lambda: missions.get(BOB, stored.id), lambda: missions.versions(BOB, stored.id), lambda: missions.version(BOB, stored.id, 1),
        lambda: missions.difference(BOB, stored.id, 0, 1), lambda: missions.save(BOB, stored.id, "x", after=1), lambda: missions.delete(BOB, stored.id),
        lambda: missions.change(BOB, stored.id, tags=()), lambda: missions.get(BOB, 99),
    ):  # fmt: skip
        with pytest.raises(NotFound, match="no stored mission"):
            ask()
    assert missions.listed(BOB) == ()
    assert [each.name for each in missions.listed(ROOT)] == ["patrol"]
    missions.change(ALICE, stored.id, project="show")
    assert missions.listed(BOB) == ()
    people.references.share("show", True, ALICE)
    assert [each.name for each in missions.listed(EVE)] == ["patrol"]
    assert missions.save(BOB, stored.id, "seed: 3", after=1).by == "bob"
    for forbidden in (
        lambda: missions.delete(BOB, stored.id), lambda: missions.change(BOB, stored.id, project=""), lambda: missions.save(EVE, stored.id, "x", after=2),
        lambda: missions.store(EVE, "mine", "x"), lambda: missions.delete(EVE, stored.id),
    ):  # fmt: skip
        with pytest.raises(Forbidden):
            forbidden()
    missions.delete(ALICE, stored.id)
    assert missions.listed(ROOT) == ()
    assert people.database.read("SELECT * FROM mission_versions") == []
    assert people.log.entries()[0].action == "delete mission"


def test_it_is_found_by_name_owner_tag_project_and_text(people: People, stored: StoredMission) -> None:
    missions = people.missions
    missions.store(ALICE, "race", "formula: F gate", project="show")
    for search, names in (
        ("PATROL", ["patrol"]),
        ("alice", ["race", "patrol"]),
        ("night", ["patrol"]),
        ("show", ["race"]),
        ("f GATE", ["race"]),
        ("%", []),
        ("nothing", []),
    ):
        assert [each.name for each in missions.listed(ALICE, search=search)] == names, search
    assert [each.name for each in missions.listed(ALICE, tag="lab")] == ["patrol"]
    assert [each.name for each in missions.listed(ALICE, project="show")] == ["race"]
    assert missions.listed(ALICE, tag="nigh") == ()


def test_names_tags_and_texts_that_cannot_be(people: People, stored: StoredMission) -> None:
    missions = people.missions
    for name in ("", " ", " a", "a\n", "x" * 61, "\u202e"):
        with pytest.raises(BadInput, match="cannot name a mission"):
            missions.store(ALICE, name, "x")
    for tags in (("",), ("a b",), ("x" * 31,), ("a\n",), tuple("abcdefghijk")):
        with pytest.raises(BadInput, match="tag"):
            missions.store(ALICE, "new", "x", tags=tags)
    with pytest.raises(BadInput, match="letters is not stored"):
        missions.store(ALICE, "new", "x" * (LONGEST + 1))
    with pytest.raises(Conflict, match="already"):
        missions.store(ALICE, "patrol", "x")
    assert missions.store(BOB, "patrol", "<script>'\";--").name == "patrol", "names are each owner's own"
    assert len(missions.listed(ROOT)) == 2


def test_tables_of_the_first_format_are_brought_up_to_date(people: People) -> None:
    people.accounts.add("alice", Role.viewer)
    with people.database.changing() as run:
        for table in ("missions", "mission_versions", "studies", "study_members", "webhooks", "webhook_calls"):
            run.execute(f"DROP TABLE {table}")
        run.execute("ALTER TABLE leaving DROP COLUMN since")
        run.execute("INSERT INTO leaving VALUES ('a-1')")
        run.execute("PRAGMA user_version = 1")
    people.close()
    assert people.references.leaving("2026-01-01") == ("a-1",), "it left before anything was known of when"
    assert people.missions.listed(ALICE) == ()
    assert people.studies.listed(ALICE) == ()
    assert [each.name for each in people.accounts.all()] == ["alice"]
