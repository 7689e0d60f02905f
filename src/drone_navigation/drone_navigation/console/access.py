"""Access to the console by HTTP: exact Host and Origin, and a token. No I/O.

A page of another site can make a browser send requests to loopback, and a rebound host name can
make it believe that they go to that site. The Host shows the second, the Origin the first; the
token keeps out other users of the machine.
"""

from __future__ import annotations

import hmac
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

__all__ = ["TOKEN_LENGTH_MIN", "Access", "Denied"]

TOKEN_LENGTH_MIN = 22
"""Characters of a token: 128 bits in base64."""

_LOOPBACK_NAMES = ("127.0.0.1", "localhost")


@dataclass(frozen=True)
class Denied:
    """A request that is not served.

    Attributes:
        status: of HTTP.
        kind: by which it is counted: "host", "origin" or "token".
        sentence: for people.
    """

    status: int
    kind: str
    sentence: str


class Access:
    """Rules of one web server."""

    def __init__(self, token: str, host: str, port: int) -> None:
        """Prepare.

        Args:
            token: what every address must carry.
            host: name or address on which the server listens.
            port: its port.
        """
        names = {host, *_LOOPBACK_NAMES} if host in _LOOPBACK_NAMES else {host}
        self._token = token
        self._hosts = frozenset(f"{name}:{port}" for name in names)
        self._origins = frozenset(f"http://{name}" for name in self._hosts)

    def check(
        self,
        path: str,
        hosts: Sequence[str],
        origins: Sequence[str],
        *,
        token: bool,
        origin: bool,
    ) -> Denied | None:
        """Return why a request is not served, or None.

        Args:
            path: with its query.
            hosts: every Host header.
            origins: every Origin header.
            token: whether the query must carry the token.
            origin: whether an Origin is required; one that is there must be right in any case.
        """
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return Denied(421, "host", "This host name is not one of this console.")
        if len(origins) > 1 or (origin and not origins):
            return Denied(403, "origin", "A request must name its origin once.")
        if origins and origins[0] not in self._origins:
            return Denied(403, "origin", "This origin is not this console.")
        if token and not self._knows_token(path):
            return Denied(
                403, "token", "The token is missing or old: open the address the console printed."
            )
        return None

    def _knows_token(self, path: str) -> bool:
        given = parse_qs(urlsplit(path).query).get("token", [])
        return len(given) == 1 and hmac.compare_digest(given[0].encode(), self._token.encode())
