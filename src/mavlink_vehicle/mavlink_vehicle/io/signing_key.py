"""The file that holds the key for MAVLink signing."""

from __future__ import annotations

import hashlib
import re
import stat
import time
from collections.abc import Callable
from pathlib import Path

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.signing import KEY_SIZE, Signing

_LARGEST_FILE = 4096
_HEXADECIMAL = re.compile(f"[0-9A-Fa-f]{{{2 * KEY_SIZE}}}")


def open_signing(path: str | None, warn: Callable[[str], object]) -> Signing | None:
    """Return the signing with the key in a file and the time of this machine, or without: None.

    Raises:
        LinkError: there is no such file, or no key in it.
    """
    if path is None:
        return None
    key, warning = read_signing_key(path)
    if warning is not None:
        warn(warning)
    return Signing(key, time.time)


def read_signing_key(path: str) -> tuple[bytes, str | None]:
    """Read a key; returns it and a warning, or None, about who can read the file.

    The file is one line: 64 hexadecimal digits are the key itself, anything else is a
    passphrase, whose SHA-256 is the key, as with QGroundControl, Mission Planner and MAVProxy.

    Raises:
        LinkError: there is no such file, or no key in it.
    """
    file = Path(path)
    try:
        mode = file.stat().st_mode
        if not stat.S_ISREG(mode):
            raise LinkError(f"signing_key_file: {path} is not a file.")
        with file.open("rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise LinkError(f"signing_key_file: cannot read {path}: {reason}.") from error
    key = _key(path, content)
    warning = None
    if mode & (stat.S_IRGRP | stat.S_IROTH):
        warning = (
            f"The signing key in {path} is readable by other users of this machine; restrict it "
            "with chmod 600."
        )
    return key, warning


def _key(path: str, content: bytes) -> bytes:
    if len(content) > _LARGEST_FILE:
        raise LinkError(
            f"signing_key_file: {path} is larger than {_LARGEST_FILE} bytes; it holds one line."
        )
    try:
        text = content.decode("utf-8").strip("\r\n")
    except UnicodeDecodeError as error:
        raise LinkError(f"signing_key_file: {path} is not text in UTF-8.") from error
    if not text.strip():
        raise LinkError(
            f"signing_key_file: {path} is empty; write 64 hexadecimal digits or a passphrase."
        )
    if "\n" in text or "\r" in text:
        raise LinkError(
            f"signing_key_file: {path} has several lines; it holds one key or passphrase."
        )
    if _HEXADECIMAL.fullmatch(text.strip()):
        key = bytes.fromhex(text.strip())
        if not any(key):
            raise LinkError(
                f"signing_key_file: the key in {path} is all zeros, which MAVLink treats as no key."
            )
        return key
    return hashlib.sha256(text.encode("utf-8")).digest()
