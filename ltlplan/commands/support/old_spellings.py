"""Former spellings of commands and options: they go on, with a note on standard error."""

from __future__ import annotations

from verify.data.errors import BadInput

OPTIONS = {
    "audit": {"--own-limits": "--file-limits", "--no-own-limits": "--no-file-limits"},
    "certify": {"--called": "--rename"},
    "check": {"--reading": "--team"},
    "export": {"--anyway": "--force"},
}
"""The present name of each former option, by command."""


def spelled_now(words: list[str]) -> tuple[list[str], str | None]:
    """Return the words of a command as it is called now, and a note where that is not how they were written.

    Former options are listed in `OPTIONS`. `fly --runs N` is `campaign --runs N`, `fly --runs 1` is `fly`, and `fly --online` is `online`.

    Args:
        words: Command, arguments and options.

    Raises:
        BadInput: An option is given by both of its names.
    """
    end = words.index("--") if "--" in words else len(words)
    if not words:
        return words, None
    given, rest = words[1:end], words[end:]
    for old, now in OPTIONS.get(words[0], {}).items():
        if any(_is(word, old) for word in given):
            if any(_is(word, now) for word in given):
                raise BadInput(f"`{old}` is the former name of `{now}`; give `{now}` alone.")
            renamed = [now + word.removeprefix(old) if _is(word, old) else word for word in given]
            return [words[0], *renamed, *rest], f"`{old}` is `{now}` now."
    if words[0] != "fly":
        return words, None
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


def _is(word: str, option: str) -> bool:
    return word == option or word.startswith(f"{option}=")


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
