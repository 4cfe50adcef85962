"""What commands were called before: old words go on, with a note on standard error."""

from __future__ import annotations


def spelled_now(words: list[str]) -> tuple[list[str], str | None]:
    """Return the words of a command as it is called now, and a note where that is not how they were written.

    `fly --runs N` is `campaign --runs N`, `fly --runs 1` is `fly`, and `fly --online` is `online`.

    Args:
        words: Command, arguments and options.
    """
    end = words.index("--") if "--" in words else len(words)
    if not words or words[0] != "fly":
        return words, None
    given, rest = words[1:end], words[end:]
    if "--online" in given:
        now = ["online", *(word for word in given if word != "--online")]
        return [*now, *rest], "`ltlplan fly --online` is `ltlplan online` now."
    single, runs = _without(given, "--runs")
    single, workers = _without(single, "--workers")
    if runs not in (None, "1"):
        return ["campaign", *given, *rest], "`ltlplan fly --runs` is `ltlplan campaign --runs` now."
    if runs or workers:
        return ["fly", *single, *rest], "`ltlplan fly` flies once; --runs and --workers belong to `ltlplan campaign`."
    return words, None


def _without(words: list[str], option: str) -> tuple[list[str], str | None]:
    """Return the words without an option and its value, and the last such value."""
    left: list[str] = []
    value, at = None, 0
    while at < len(words):
        name, equals, behind = words[at].partition("=")
        if name != option:
            left.append(words[at])
        elif equals:
            value = behind
        elif at + 1 < len(words):
            at += 1
            value = words[at]
        else:
            left.append(words[at])  # its value is missing, which the command will say
        at += 1
    return left, value
