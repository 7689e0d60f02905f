"""Map tiles from a local file: a folder `z/x/y.png`, or a PMTiles archive. No ROS, no network.

https://github.com/protomaps/PMTiles/blob/main/spec/v3/spec.md
"""

from __future__ import annotations

import os
import re
import zlib
from functools import lru_cache
from pathlib import Path
from typing import Protocol

from pmtiles.tile import (
    Compression,
    Entry,
    TileType,
    deserialize_directory,
    deserialize_header,
    find_tile,
    zxy_to_tileid,
)

__all__ = ["Archive", "Folder", "TileError", "Tiles", "media_type", "open_tiles", "tile_of"]

ZOOM_MAX = 24
_EXTENSIONS = ("png", "jpg", "jpeg", "webp")
_RASTER = {TileType.PNG, TileType.JPEG, TileType.WEBP}
_ADDRESS = re.compile(r"/tile/([0-9]{1,2})/([0-9]{1,8})/([0-9]{1,8})")
# Of a tile, and of a directory.
_TILE_MAX_BYTES = 4_000_000
_HEADER_BYTES = 127
_DIRECTORIES_MAX = 64
# A root, leaves, and leaves of leaves.
_DEPTH_MAX = 4
_DAMAGE = (OSError, EOFError, ValueError, IndexError, OverflowError, zlib.error)


class TileError(ValueError):
    """There are no tiles to show; the text says why."""


class Tiles(Protocol):
    """Where tiles come from.

    Attributes:
        zoom_min: least zoom that has any.
        zoom_max: greatest zoom that has any.
    """

    zoom_min: int
    zoom_max: int

    def read(self, zoom: int, x: int, y: int) -> bytes | None:
        """Return an image, None if there is none; y counts from the north."""


def open_tiles(path: Path) -> Tiles:
    """Return the tiles in a folder or a PMTiles archive.

    Raises:
        TileError: there are none, or none that can be drawn.
    """
    try:
        return Folder(path) if path.is_dir() else Archive(path)
    except OSError as error:
        raise TileError(f"Cannot read {path}: {error.strerror or error}.") from None


def tile_of(path: str) -> tuple[int, int, int] | None:
    """Return zoom, x and y in the path of an address; None if it is not that of a tile."""
    found = _ADDRESS.fullmatch(path)
    if found is None:
        return None
    zoom, x, y = map(int, found.groups())
    return (zoom, x, y) if zoom <= ZOOM_MAX and max(x, y) < 1 << zoom else None


def media_type(content: bytes) -> str | None:
    """Return the media type of an image, None if it is of no kind that is served."""
    if content.startswith(b"\x89PNG\r\n\x1a\n"):
        return "image/png"
    if content.startswith(b"\xff\xd8\xff"):
        return "image/jpeg"
    if content[:4] == b"RIFF" and content[8:12] == b"WEBP":
        return "image/webp"
    return None


class Folder:
    """Tiles in files `z/x/y.png`, `.jpg` or `.webp`; see `Tiles`."""

    def __init__(self, path: Path) -> None:
        """Find the zooms.

        Raises:
            TileError: there are none.
            OSError: it cannot be read.
        """
        self._root = path.resolve()
        zooms = [
            int(child.name)
            for child in self._root.iterdir()
            if re.fullmatch("[0-9]{1,2}", child.name) and child.is_dir()
        ]
        zooms = [zoom for zoom in zooms if zoom <= ZOOM_MAX]
        if not zooms:
            raise TileError(f"{path} has no folders named by zoom, with tiles as z/x/y.png.")
        self.zoom_min, self.zoom_max = min(zooms), max(zooms)

    def read(self, zoom: int, x: int, y: int) -> bytes | None:
        """See `Tiles`."""
        for extension in _EXTENSIONS:
            file = self._root / str(zoom) / str(x) / f"{y}.{extension}"
            try:
                # A link must not lead out of the folder.
                if not file.resolve(strict=True).is_relative_to(self._root):
                    return None
                with file.open("rb") as opened:
                    content = opened.read(_TILE_MAX_BYTES + 1)
            except (OSError, RuntimeError):
                continue
            return content if len(content) <= _TILE_MAX_BYTES else None
        return None


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
        """See `Tiles`; what is damaged is not there."""
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
        if length > _TILE_MAX_BYTES:
            raise ValueError
        content = os.pread(self._file, length, offset)
        if len(content) < length:
            raise EOFError
        return content
