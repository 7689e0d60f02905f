"""Map tiles in the form of every web map, with red squares at known places."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeAlias

from PIL import Image, ImageDraw
from pmtiles.tile import Compression, TileType, zxy_to_tileid
from pmtiles.writer import Writer

TileKey: TypeAlias = tuple[int, int, int]
"""Zoom, column from the date line, row from the north"""

SIZE_PX = 256
GROUND, MARK = (190, 215, 190), (230, 0, 0)
_AROUND = 2
_WRITER: Any = Writer  # has no types
_HALF_PX = 3.0


def pixel(latitude_deg: float, longitude_deg: float, zoom: int) -> tuple[float, float]:
    """Return a place in pixels of the whole map at a zoom, from its north-western corner.

    https://wiki.openstreetmap.org/wiki/Slippy_map_tilenames
    """
    whole = SIZE_PX * 2.0**zoom
    up = math.asinh(math.tan(math.radians(latitude_deg)))
    return (longitude_deg + 180.0) / 360.0 * whole, 0.5 * (1.0 - up / math.pi) * whole


def draw_tiles(places: Sequence[tuple[float, float]], zoom: int) -> dict[TileKey, bytes]:
    """Return PNG tiles around places (latitude and longitude, degrees), each with its mark."""
    drawn: dict[TileKey, Image.Image] = {}
    count = 1 << zoom
    for place in places:
        x, y = pixel(*place, zoom)
        column, row = int(x // SIZE_PX), int(y // SIZE_PX)
        for i in range(column - _AROUND, column + _AROUND + 1):
            for j in range(max(row - _AROUND, 0), min(row + _AROUND + 1, count)):
                key = (zoom, i % count, j)
                image = drawn.setdefault(key, Image.new("RGB", (SIZE_PX, SIZE_PX), GROUND))
                # A pixel is drawn from its centre on.
                left, top = x - i * SIZE_PX - 0.5, y - j * SIZE_PX - 0.5
                corners = (left - _HALF_PX, top - _HALF_PX, left + _HALF_PX, top + _HALF_PX)
                ImageDraw.Draw(image).rectangle([round(c) for c in corners], fill=MARK)
    return {key: _png(image) for key, image in drawn.items()}


def _png(image: Image.Image) -> bytes:
    content = io.BytesIO()
    image.save(content, "PNG")
    return content.getvalue()


def write_folder(tiles: dict[TileKey, bytes], folder: Path) -> Path:
    """Write tiles as `z/x/y.png` into a folder."""
    for (zoom, x, y), content in tiles.items():
        file = folder / str(zoom) / str(x) / f"{y}.png"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    return folder


def write_archive(tiles: dict[TileKey, bytes], path: Path, kind: TileType = TileType.PNG) -> Path:
    """Write tiles into a PMTiles archive."""
    with path.open("wb") as file:
        writer: Any = _WRITER(file)
        for key in sorted(tiles, key=lambda key: zxy_to_tileid(*key)):
            writer.write_tile(zxy_to_tileid(*key), tiles[key])
        writer.finalize({"tile_type": kind, "tile_compression": Compression.NONE}, {})
    return path
