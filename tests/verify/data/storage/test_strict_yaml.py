"""YAML at the limits of what is accepted."""

import pytest

from verify.data.storage.strict_yaml import MAX_NUMBER, NotAccepted, load_tree


def test_a_number_may_be_as_long_as_is_said_and_no_longer():
    number = "0." + "1" * (MAX_NUMBER - 2)
    assert float(load_tree(f"a: {number}")["a"]) == pytest.approx(1 / 9)
    with pytest.raises(NotAccepted, match=f"a number of {MAX_NUMBER + 1} characters; {MAX_NUMBER} is the most"):
        load_tree(f"a: {number}1")
