"""Map tiles from a folder `z/x/y.png`, and what all tiles have. No ROS, no network."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Protocol

__all__ = ["TILE_MAX_BYTES", "ZOOM_MAX", "Folder", "TileError", "Tiles", "media_type", "tile_of"]

ZOOM_MAX = 24
_EXTENSIONS = ("png", "jpg", "jpeg", "webp")
_ADDRESS = re.compile(r"/tile/([0-9]{1,2})/([0-9]{1,8})/([0-9]{1,8})")
TILE_MAX_BYTES = 4_000_000
"""Of a tile, and of a directory"""


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
                    content = opened.read(TILE_MAX_BYTES + 1)
            except (OSError, RuntimeError):
                continue
            return content if len(content) <= TILE_MAX_BYTES else None
        return None
