"""The command line of ``navigation_console``. No ROS."""

from __future__ import annotations

import argparse
import secrets
from pathlib import Path

from drone_navigation.console.access import TOKEN_LENGTH_MIN
from flight_logs.command_version import add_version

__all__ = ["LOOPBACK", "TokenError", "is_loopback", "make_parser", "token_of"]

LOOPBACK = "127.0.0.1"
_ANY = ("0.0.0.0", "::", "")
_READABLE_BY_OTHERS = 0o077


_PORT_MAX = 65535


class TokenError(ValueError):
    """There is no token to use; the text says why."""


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of ``navigation_console``."""
    parser = argparse.ArgumentParser(
        prog="navigation_console",
        description="Show the vehicles of this ROS domain on a page in the browser, and fly them "
        "from there. Start it beside a navigation_server; Ctrl-C ends it.",
    )
    add_version(parser, "drone_navigation")
    parser.add_argument(
        "--port", type=_port, default=0, metavar="N", help="TCP port (default: a free one)"
    )
    parser.add_argument(
        "--no-browser", action="store_true", help="print the address, but open no browser"
    )
    parser.add_argument(
        "--host",
        default=LOOPBACK,
        metavar="HOST",
        help="address to listen on, one of this machine's own (default: %(default)s); any other "
        "than loopback needs --token-file, and is not encrypted",
    )
    parser.add_argument(
        "--token-file",
        type=Path,
        metavar="FILE",
        help=f"file with a token of {TOKEN_LENGTH_MIN} or more characters that only its owner can "
        "read (default: a random token)",
    )
    parser.add_argument(
        "--tiles",
        type=Path,
        metavar="PATH",
        help="map tiles to draw below the grid: a folder z/x/y.png (.jpg, .webp), or a PMTiles "
        "file of raster tiles",
    )
    return parser


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > _PORT_MAX:
        raise argparse.ArgumentTypeError(f"'{text}' is not a port from 0 to {_PORT_MAX}")
    return int(text)


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach it."""
    return host in (LOOPBACK, "localhost")


def token_of(options: argparse.Namespace) -> str:
    """Return the token.

    Raises:
        TokenError: the file has none that will do, or the address needs one.
    """
    if options.host in _ANY:
        raise TokenError(
            "--host needs one of this machine's addresses, at which the page is opened."
        )
    if options.token_file is None:
        if not is_loopback(options.host):
            raise TokenError(f"--host {options.host} needs --token-file: others can reach it.")
        return secrets.token_urlsafe(24)
    path: Path = options.token_file
    try:
        if path.stat().st_mode & _READABLE_BY_OTHERS:
            raise TokenError(f"{path} can be read by others: chmod 600 {path}.")
        token = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise TokenError(f"{path}: {error}.") from None
    if len(token) < TOKEN_LENGTH_MIN or not token.replace("-", "").replace("_", "").isalnum():
        raise TokenError(
            f"{path} has no token of {TOKEN_LENGTH_MIN} or more letters, digits, - and _."
        )
    return token
