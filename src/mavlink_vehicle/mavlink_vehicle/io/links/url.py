"""Parses link URLs in the notations of MAVSDK and pymavlink.

MAVSDK's:    udpin://0.0.0.0:14550  udpout://127.0.0.1:14550  tcpout://127.0.0.1:5760
             tcpin://127.0.0.1:5760  serial:///dev/ttyACM0:57600   (also udp:// and tcp://)
pymavlink's: udpin:0.0.0.0:14550  udpout:127.0.0.1:14550  tcp:127.0.0.1:5760
             tcpin:127.0.0.1:5760  /dev/ttyACM0,57600  tlog:PATH
"""

from __future__ import annotations

import enum
import ipaddress
import re
import socket
from dataclasses import dataclass

from mavlink_vehicle.errors import LinkError

DEFAULT_BAUD = 57600

EXAMPLES = (
    "Write for example udpin://127.0.0.1:14550, udpout://127.0.0.1:14550, "
    "tcpout://127.0.0.1:5760, tcpin://127.0.0.1:5760, serial:///dev/ttyACM0:57600 or "
    "tlog:flight.tlog."
)


class LinkKind(enum.Enum):
    """The kind of link that a URL names."""

    UDP_IN = "udpin"
    UDP_OUT = "udpout"
    TCP_IN = "tcpin"
    TCP_OUT = "tcpout"
    SERIAL = "serial"
    TLOG = "tlog"


# `udp:` and `tcp:` mean what each of the two families means by them: MAVSDK's and pymavlink's
# udp both listen, their tcp both connect.
_SCHEMES = {
    "udp": LinkKind.UDP_IN,
    "udpin": LinkKind.UDP_IN,
    "udpout": LinkKind.UDP_OUT,
    "tcp": LinkKind.TCP_OUT,
    "tcpout": LinkKind.TCP_OUT,
    "tcpin": LinkKind.TCP_IN,
    "serial": LinkKind.SERIAL,
    "tlog": LinkKind.TLOG,
}
_HOST_PORT = re.compile(r"(?P<host>\[[^\]]*\]|[^:/\s]*):(?P<port>\d+)/?")


@dataclass(frozen=True)
class LinkUrl:
    """A link as it was written, taken apart.

    Attributes:
        kind: what it is.
        host: host name or address of a UDP or TCP link.
        port: port of a UDP or TCP link.
        path: device of a serial link, file of a tlog link.
        baud: of a serial link.
    """

    kind: LinkKind
    host: str = ""
    port: int = 0
    path: str = ""
    baud: int = DEFAULT_BAUD

    def __str__(self) -> str:
        """Return it in MAVSDK's style."""
        if self.kind is LinkKind.SERIAL:
            return f"serial://{self.path}:{self.baud}"
        if self.kind is LinkKind.TLOG:
            return f"tlog:{self.path}"
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind.value}://{host}:{self.port}"

    @property
    def listens(self) -> bool:
        """Whether others connect to us."""
        return self.kind in (LinkKind.UDP_IN, LinkKind.TCP_IN)

    @property
    def note(self) -> str | None:
        """A note on where a link listens; None if it does not listen."""
        if not self.listens:
            return None
        if not self.is_exposed:
            anywhere = "[::]" if ":" in self.host else "0.0.0.0"
            return (
                f"{self} listens on this machine only. To listen on all interfaces write "
                f"{self.kind.value}://{anywhere}:{self.port}."
            )
        return (
            f"{self} listens beyond this machine: anyone who reaches port {self.port} can talk to "
            f"the vehicle. Use 127.0.0.1 where the vehicle runs on this machine."
        )

    @property
    def is_exposed(self) -> bool:
        """Whether other machines may reach it."""
        return self.listens and not _is_loopback(self.host)


def parse_url(url: str) -> LinkUrl:
    """Parse a URL.

    Raises:
        LinkError: it isn't one; the sentence shows right ones.
    """
    text = url.strip()
    scheme, colon, rest = text.partition(":")
    if text.startswith("/") or re.fullmatch(r"COM\d+(,\d+)?", text):
        return _serial(url, text)
    kind = _SCHEMES.get(scheme.lower())
    if not colon or kind is None:
        raise LinkError(f"{url!r} is not a link. {EXAMPLES}")
    rest = rest.removeprefix("//")
    if kind is LinkKind.SERIAL:
        return _serial(url, rest)
    if kind is LinkKind.TLOG:
        if not rest:
            raise LinkError(f"{url!r} names no file. {EXAMPLES}")
        return LinkUrl(kind, path=rest)
    match = _HOST_PORT.fullmatch(rest)
    if match is None:
        raise LinkError(f"{url!r} has no host and port. {EXAMPLES}")
    host, port = match["host"].strip("[]"), int(match["port"])
    lowest = 0 if kind in (LinkKind.UDP_IN, LinkKind.TCP_IN) else 1
    if not lowest <= port <= 65535:
        raise LinkError(f"{url!r}: a port is {lowest} to 65535, not {port}. {EXAMPLES}")
    if not host:
        # A listener without a host stays on this machine; a caller must say whom it calls.
        if kind in (LinkKind.UDP_OUT, LinkKind.TCP_OUT):
            raise LinkError(f"{url!r} names no host to connect to. {EXAMPLES}")
        host = "127.0.0.1"
    return LinkUrl(kind, host=host, port=port)


def resolve(url: LinkUrl, kind: socket.SocketKind) -> tuple[socket.AddressFamily, tuple[str, int]]:
    """Return address family and address of a UDP or TCP link; IPv4 where there are both.

    A simulator on "localhost" listens at 127.0.0.1, while the name may mean ::1 first.

    Raises:
        LinkError: the host is not known.
    """
    try:
        found = socket.getaddrinfo(url.host, url.port, type=kind)
    except OSError as error:
        raise LinkError(
            f"Cannot open {url}: the host {url.host!r} is unknown ({error.strerror or error})."
        ) from error
    family, _, _, _, address = min(found, key=lambda entry: entry[0] != socket.AF_INET)
    return family, (str(address[0]), int(address[1]))


def _serial(url: str, text: str) -> LinkUrl:
    """Read `DEVICE`, `DEVICE:BAUD` or `DEVICE,BAUD`."""
    match = re.fullmatch(r"(?P<path>[^,]+?)(?:[:,](?P<baud>\d+))?", text)
    if match is None:
        raise LinkError(f"{url!r} names no serial device. {EXAMPLES}")
    baud = int(match["baud"]) if match["baud"] else DEFAULT_BAUD
    if baud <= 0:
        raise LinkError(f"{url!r}: the baud rate must be positive. {EXAMPLES}")
    return LinkUrl(LinkKind.SERIAL, path=match["path"], baud=baud)


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"
