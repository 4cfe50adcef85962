"""YAML at the limits of what is accepted."""

from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from verify.data.storage.strict_yaml import MAX_NUMBER, NotAccepted, load_tree


def test_a_number_may_be_as_long_as_is_said_and_no_longer():
    number = "0." + "1" * (MAX_NUMBER - 2)
    assert float(load_tree(f"a: {number}")["a"]) == pytest.approx(1 / 9)
    with pytest.raises(NotAccepted, match=f"a number of {MAX_NUMBER + 1} characters; {MAX_NUMBER} is the most"):
        load_tree(f"a: {number}1")


@pytest.mark.parametrize("name", ["firefighting", "office", "wall-swap"])
def test_a_tree_is_that_of_ruamels_own_reader(name: str) -> None:
    """Its values and where they stand; comments are not kept."""
    text = (Path(__file__).parents[4] / "ltlplan" / "missions" / f"{name}.yaml").read_text(encoding="utf-8")
    assert _placed(load_tree(text)) == _placed(YAML(typ="rt", pure=True).load(text))


def _placed(node: Any) -> object:
    if isinstance(node, CommentedMap):
        return [(key, node.lc.key(key), _placed(value)) for key, value in node.items()]
    if isinstance(node, CommentedSeq):
        return [(node.lc.item(index), _placed(value)) for index, value in enumerate(node)]
    return type(node), repr(node)
