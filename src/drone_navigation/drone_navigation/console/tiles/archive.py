"""Map tiles from a PMTiles archive. No ROS, no network.

https://github.com/protomaps/PMTiles/blob/main/spec/v3/spec.md
"""

from __future__ import annotations

import os
import zlib
from functools import lru_cache
from pathlib import Path

from pmtiles.tile import (
    Compression,
    Entry,
    TileType,
    deserialize_directory,
    deserialize_header,
    find_tile,
    zxy_to_tileid,
)

from drone_navigation.console.tiles.folder import TILE_MAX_BYTES, ZOOM_MAX, TileError

__all__ = ["Archive"]

_RASTER = {TileType.PNG, TileType.JPEG, TileType.WEBP}
_HEADER_BYTES = 127
_DIRECTORIES_MAX = 64
# A root, leaves, and leaves of leaves.
_DEPTH_MAX = 4
_DAMAGE = (OSError, EOFError, ValueError, IndexError, OverflowError, zlib.error)


class Archive:
    """Raster tiles in a PMTiles archive of version 3; see `Tiles`.

    It is read, not mapped: a mapped file that is cut short ends the process.
    """

    def __init__(self, path: Path) -> None:
        """Read header and root directory.

        Raises:
            TileError: it is no such archive.
            OSError: it cannot be read.
        """
        self._file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        try:
            header = os.pread(self._file, _HEADER_BYTES, 0)
            if header[:7] != b"PMTiles":
                raise TileError(f"{path} is neither a folder of tiles nor a PMTiles archive.")
            if len(header) < _HEADER_BYTES:
                raise TileError(f"{path} is truncated.")
            if header[7] != 3:
                raise TileError(f"{path} is PMTiles of version {header[7]}; only 3 is read.")
            self._open(path, header)
        except TileError:
            os.close(self._file)
            raise

    def _open(self, path: Path, header: bytes) -> None:
        try:
            self._header = deserialize_header(header)
        except ValueError:
            raise TileError(f"{path} has tiles of an unknown kind; PNG, JPEG or WebP.") from None
        if self._header["tile_type"] not in _RASTER:
            kind = self._header["tile_type"].name
            raise TileError(f"{path} has {kind} tiles; only PNG, JPEG and WebP can be drawn.")
        if self._header["internal_compression"] is not Compression.GZIP:
            raise TileError(f"The directories of {path} are not compressed by gzip.")
        self.zoom_min = self._header["min_zoom"]
        self.zoom_max = min(self._header["max_zoom"], ZOOM_MAX)
        self._directory = lru_cache(_DIRECTORIES_MAX)(self._read_directory)
        try:
            self._directory(self._header["root_offset"], self._header["root_length"])
        except _DAMAGE:
            raise TileError(f"{path} is damaged: its directory cannot be read.") from None

    def read(self, zoom: int, x: int, y: int) -> bytes | None:
        """See `Tiles`; a damaged part counts as missing."""
        try:
            return self._find(zxy_to_tileid(zoom, x, y))
        except _DAMAGE:
            return None

    def _find(self, tile_id: int) -> bytes | None:
        header = self._header
        offset, length = header["root_offset"], header["root_length"]
        for _ in range(_DEPTH_MAX):
            entry = find_tile(self._directory(offset, length), tile_id)
            if entry is None:
                return None
            if entry.run_length:
                return self._bytes(header["tile_data_offset"] + entry.offset, entry.length)
            offset, length = header["leaf_directory_offset"] + entry.offset, entry.length
        return None

    def _read_directory(self, offset: int, length: int) -> list[Entry]:
        return deserialize_directory(self._bytes(offset, length))

    def _bytes(self, offset: int, length: int) -> bytes:
        if length > TILE_MAX_BYTES:
            raise ValueError
        content = os.pread(self._file, length, offset)
        if len(content) < length:
            raise EOFError
        return content
