"""Tokens: who holds one, and damaged files of them."""

from __future__ import annotations

import stat
import threading
from pathlib import Path

import pytest

from ltlplan.service.security.tokens import FILE, Tokens
from verify.data import BadInput


def test_a_token_is_known_until_it_is_revoked_and_stands_in_no_file(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    assert not tokens.needed
    token = tokens.new("alice")
    assert tokens.needed
    assert tokens.owner(token) == Tokens(tmp_path).owner(token) == "alice"
    assert tokens.owner(token[:-1]) is tokens.owner("") is tokens.owner("\udcff") is None
    for path in tmp_path.iterdir():
        assert token not in path.read_text(errors="replace")
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    tokens.revoke("alice")
    assert tokens.owner(token) is None


def test_what_another_process_changes_counts_at_once(tmp_path: Path) -> None:
    ours, theirs = Tokens(tmp_path), Tokens(tmp_path)
    token = theirs.new("bob")
    assert ours.owner(token) == "bob"
    theirs.revoke("bob")
    assert ours.owner(token) is None


def test_tokens_made_at_the_same_time_are_all_kept(tmp_path: Path) -> None:
    threads = [threading.Thread(target=Tokens(tmp_path).new, args=(f"robot-{i}",)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(Tokens(tmp_path).names()) == [f"robot-{i}" for i in range(8)]


@pytest.mark.parametrize("name", ["", "a b", "../x", "a:b", "x" * 61, "é", "127.0.0.1", "Local"])
def test_names_of_tokens(name: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot name a token"):
        Tokens(tmp_path).new(name)


def test_a_name_that_is_taken_and_one_that_is_not_there(tmp_path: Path) -> None:
    tokens = Tokens(tmp_path)
    tokens.new("alice")
    with pytest.raises(BadInput, match="already"):
        tokens.new("alice")
    with pytest.raises(BadInput, match="Did you mean 'alice'"):
        tokens.revoke("alise")


@pytest.mark.parametrize("text", ["", "{}", '{"format": 3, "tokens": []}', '{"format": 1, "tokens": [{"name": 1}]}', "[1]"])
def test_a_file_of_tokens_that_is_none_opens_nothing(text: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(text)
    with pytest.raises(BadInput):
        Tokens(tmp_path).owner("x")
