"""Link addresses, as MAVSDK writes them (udpout://host:port) and pymavlink (udpout:host:port)."""

from __future__ import annotations

import re
from dataclasses import dataclass

KINDS = ("udpout", "udpin", "tcpin", "tcpout")

_PATTERN = re.compile(r"(?P<kind>[a-z]+):(?://)?(?P<host>\[[^\]]+\]|[^:\[\]/]*):(?P<port>\d+)")


class AddressError(ValueError):
    """A link that cannot be read; the message shows one that can."""


@dataclass(frozen=True)
class LinkAddress:
    """The address to which a link sends, or on which it listens.

    Attributes:
        kind: one of KINDS.
        host: name or address.
        port: 0..65535; 0 lets the system choose, on a listening link.
    """

    kind: str
    host: str
    port: int

    @property
    def listens(self) -> bool:
        """Whether others come to us."""
        return self.kind in ("udpin", "tcpin")

    def __str__(self) -> str:
        """MAVSDK's form."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind}://{host}:{self.port}"


def parse_address(text: str) -> LinkAddress:
    """Read an address; `tcp` means tcpout, and an empty host this machine alone.

    Raises:
        AddressError: it cannot be read.
    """
    match = _PATTERN.fullmatch(text.strip())
    kind = match["kind"] if match else ""
    kind = "tcpout" if kind == "tcp" else kind
    if match is None or kind not in KINDS:
        raise AddressError(
            f"{text!r} is not a link: write KIND://HOST:PORT with one of {', '.join(KINDS)}, for "
            "example udpout://127.0.0.1:14550"
        )
    port = int(match["port"])
    address = LinkAddress(kind, match["host"].strip("[]") or "127.0.0.1", port)
    if port > 65535 or (port == 0 and not address.listens):
        raise AddressError(f"{text!r} has no usable port: 1 to 65535")
    return address
