"""Addresses of Crazyflies by radio, such as `radio://0/80/2M/E7E7E7E701`: which radio here, then channel, rate and the vehicle's own."""

from __future__ import annotations

import re

from verify.data import BadInput

_RADIO = re.compile(
    r"radio://[0-9A-Za-z]+(/(?P<channel>\d{1,3})(/(250K|1M|2M)(/(?P<address>[0-9A-Fa-f]{1,10}))?)?)?/?(\?.*)?", re.ASCII
)
_LAST_CHANNEL = 125


def heard_by(address: str) -> str:
    """Return what of an address says who is reached: of a radio's, channel and address, by whatever radio and however written.

    Args:
        address: Such as `radio://0/80/2M/E7E7E7E701`.

    Raises:
        BadInput: It is a radio's that cannot be.
    """
    if not address.startswith("radio://"):
        return address
    said = _RADIO.fullmatch(address)
    if said is None or int(said["channel"] or 2) > _LAST_CHANNEL:
        raise BadInput(
            f"{address} is no address: write radio://RADIO/CHANNEL/RATE/ADDRESS, a channel of 0 to {_LAST_CHANNEL}, a rate of 250K, 1M or "
            "2M, and at most ten hexadecimal digits, such as radio://0/80/2M/E7E7E7E701."
        )
    return f"{int(said['channel'] or 2)} {(said['address'] or 'E7E7E7E7E7').rjust(10, '0').upper()}"
