"""Reads the packets of a telemetry log one by one, as bytes, for a replay."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from flight_logs.frames.pieces import pieces

_CHUNK_BYTES = 256 << 10


def iterate_packets(
    path: Path | str, progress: Callable[[int, int], None] | None = None
) -> Iterator[tuple[float, bytes]]:
    """Yield (seconds since 1970, packet) of all packets that `read_tlog` decodes, in their order.

    Args:
        path: the file.
        progress: called now and then with the bytes done and the size of the file.

    Raises:
        LogError: the file can't be read, or isn't a tlog.
    """
    for piece in pieces(Path(path), _CHUNK_BYTES):
        if piece.stamps is not None:
            packets, times_s = piece.packets, piece.stamps.time_s
            places = zip(
                times_s.tolist(), packets.start.tolist(), packets.stop.tolist(), strict=True
            )
            for time_s, start, stop in places:
                yield time_s, piece.data[start:stop].tobytes()
        if progress is not None:
            progress(piece.position, piece.file_size)
