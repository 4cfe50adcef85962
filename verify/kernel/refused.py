"""The one way in which the kernel says no."""


class Refused(Exception):
    """A file cannot be read, or what a proof says was not so; the message says which."""


def require(holds: object, fault: str) -> None:
    """Go on only if something holds.

    Raises:
        Refused: It does not.
    """
    if not holds:
        raise Refused(fault)
