"""Chooses how map tiles are read: from a folder or a PMTiles archive."""

from __future__ import annotations

from pathlib import Path

from drone_navigation.console.tiles.folder import Folder, TileError, Tiles
from flight_logs.errors import MissingPackageError
from flight_logs.extras import extra

__all__ = ["open_tiles"]


def open_tiles(path: Path) -> Tiles:
    """Return the tiles in a folder or a PMTiles archive.

    Raises:
        TileError: there are none, or none that can be drawn.
    """
    try:
        if path.is_dir():
            return Folder(path)
        path.stat()
        with extra("pmtiles", "A file of map tiles"):
            from drone_navigation.console.tiles.archive import Archive  # noqa: PLC0415 an extra
        return Archive(path)
    except MissingPackageError as error:
        raise TileError(str(error)) from error
    except OSError as error:
        raise TileError(f"Cannot read {path}: {error.strerror or error}.") from None
