import pytest

from verify.data import Passage, Sequence, SequenceError, parse_sequence

HOOPS = ("hoop0", "hoop1", "hoopF")


def test_sequences_are_read_and_written() -> None:
    sequence = parse_sequence("hoop0F hoop1R (hoop0F hoopFR)*", HOOPS)
    assert sequence == Sequence((Passage("hoop0", "F"), Passage("hoop1", "R")), (Passage("hoop0", "F"), Passage("hoopF", "R")))
    assert parse_sequence(str(sequence), HOOPS) == sequence


@pytest.mark.parametrize(
    ("text", "position", "says"),
    [
        ("", 0, "empty"),
        ("hoop0", 0, "lacks its side"),
        ("hoopF", 0, "lacks its side"),
        ("hoop0F hoop2F", 7, "not a hoop"),
        ("hoop0X", 0, "must end in F or R"),
        ("hoop0F ()*", 8, "empty cycle"),
        ("hoop0F (hoop1F", 14, "not closed"),
        ("(hoop0F)* hoop1F", 10, "Nothing may follow"),
        ("hoop0F, hoop1F", 6, "not expected"),
        ("(hoop0F) hoop1F", 7, "ends with"),
        ("hoop0F )*", 7, "never opened"),
        ("((hoop0F)*)*", 1, "not expected"),
    ],
)
def test_faults_are_pointed_at(text: str, position: int, says: str) -> None:
    with pytest.raises(SequenceError, match=says) as caught:
        parse_sequence(text, HOOPS)
    assert caught.value.position == position


def test_a_hostile_length_is_refused() -> None:
    with pytest.raises(SequenceError, match="More than"):
        parse_sequence("hoop0F " * 5000, HOOPS)
