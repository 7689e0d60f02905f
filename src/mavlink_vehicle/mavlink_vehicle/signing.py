"""MAVLink 2 signing: the key, and the rejection of replayed frames.

The rules are those of https://mavlink.io/en/guide/message_signing.html. They are checked here
and not by pymavlink's `check_signature`, which notes the time of a frame before it looks at
the signature: one forged frame from the future would shut the true sender out.
"""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Callable
from enum import Enum

__all__ = ["KEY_SIZE", "SIGNATURE_SIZE", "SignatureVerdict", "Signing"]

KEY_SIZE = 32
"""Bytes of a key."""
SIGNATURE_SIZE = 13
"""Bytes that follow the checksum: link id (1), timestamp (6), start of the SHA-256 (6)."""

_EPOCH_UNIX_S = 1_420_070_400
"""1 January 2015, where timestamps begin."""
_TICKS_PER_S = 100_000
_LATEST = 2**48 - 1
_NEW_STREAM_TICKS = 60 * _TICKS_PER_S
_MOST_STREAMS = 1024


class SignatureVerdict(Enum):
    """The verdict on the signature of a frame."""

    GOOD = "good"
    WRONG = "wrong"
    REPLAYED = "replayed"


class Signing:
    """The key of a network, the time of signatures, and the last time of each stream.

    All codecs of a server share one: what came in by one endpoint is a replay on any other.
    """

    def __init__(self, key: bytes, unix_time_s: Callable[[], float]) -> None:
        """Begin with no stream known.

        Args:
            key: `KEY_SIZE` bytes, the same for all that take part.
            unix_time_s: returns the seconds since 1970.

        Raises:
            ValueError: the key has another size.
        """
        if len(key) != KEY_SIZE:
            raise ValueError(f"A signing key has {KEY_SIZE} bytes, not {len(key)}.")
        self.key = key
        self._keyed_hash = hashlib.sha256(key)
        self._unix_time_s = unix_time_s
        self._last = 0
        self._streams: dict[bytes, int] = {}
        self._forgotten = 0

    def next_timestamp(self) -> int:
        """Return the time for a frame to send, 10 us since 2015: each later than the last."""
        self._last = min(max(self._last + 1, self._clock()), _LATEST)
        return self._last

    def check(self, frame: bytes) -> SignatureVerdict:
        """Judge a whole frame that says that it is signed, and remember its time if it is good."""
        keyed = self._keyed_hash.copy()
        keyed.update(frame[:-6])
        if not hmac.compare_digest(keyed.digest()[:6], frame[-6:]):
            return SignatureVerdict.WRONG
        timestamp = int.from_bytes(frame[-12:-6], "little")
        stream = frame[5:7] + frame[-SIGNATURE_SIZE : -SIGNATURE_SIZE + 1]
        last = self._streams.get(stream)
        if last is None:
            oldest = max(self._last, self._clock()) - _NEW_STREAM_TICKS
            if timestamp < oldest or timestamp <= self._forgotten:
                return SignatureVerdict.REPLAYED
            self._make_room()
        elif timestamp <= last:
            return SignatureVerdict.REPLAYED
        self._streams[stream] = timestamp
        self._last = max(self._last, timestamp)
        return SignatureVerdict.GOOD

    def _make_room(self) -> None:
        """Forget the stream that was heard the longest ago, but not how far it had come."""
        if len(self._streams) >= _MOST_STREAMS:
            stream = min(self._streams, key=self._streams.__getitem__)
            self._forgotten = max(self._forgotten, self._streams.pop(stream))

    def _clock(self) -> int:
        return int((self._unix_time_s() - _EPOCH_UNIX_S) * _TICKS_PER_S)
