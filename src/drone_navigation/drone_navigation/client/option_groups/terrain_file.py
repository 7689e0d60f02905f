"""Files with the heights of the ground."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from navigation_core.surveys.terrain import TerrainGrid

__all__ = ["TerrainFileError", "read_terrain"]

_BYTES_MAX = 100_000_000
_KEYS = frozenset(
    {
        "ncols",
        "nrows",
        "xllcorner",
        "yllcorner",
        "xllcenter",
        "yllcenter",
        "cellsize",
        "nodata_value",
    }
)


class TerrainFileError(ValueError):
    """The file cannot be used; the text says why."""


def read_terrain(path: Path) -> TerrainGrid:
    """Read a grid in metres east and north of the map origin.

    An Esri ASCII grid (``.asc``) has its rows from the north, and its corner may be that of the
    first cell or its centre. A NumPy archive (``.npz``) has ``heights``, its rows from the south,
    ``origin`` and ``resolution``.

    Raises:
        TerrainFileError: it is missing, of another kind, too large or broken.
    """
    readers = {".asc": _read_ascii, ".npz": _read_numpy}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise TerrainFileError(
            f"{path} is not a file of terrain; give .asc, an Esri ASCII grid, or .npz."
        )
    try:
        if path.stat().st_size > _BYTES_MAX:
            raise TerrainFileError(f"{path} has more than {_BYTES_MAX // 1_000_000} MB.")
        return reader(path)
    except OSError as error:
        raise TerrainFileError(f"{path} cannot be read: {error.strerror or error}.") from error
    except (ValueError, KeyError, TypeError, OverflowError, EOFError, zipfile.BadZipFile) as error:
        if isinstance(error, TerrainFileError):
            raise
        raise TerrainFileError(f"{path} is not a valid grid of heights: {error}.") from error


def _read_ascii(path: Path) -> TerrainGrid:
    words = path.read_text(encoding="ascii").split()
    header: dict[str, float] = {}
    while len(words) > 2 * len(header) + 1 and words[2 * len(header)].lower() in _KEYS:
        at = 2 * len(header)
        if words[at].lower() in header:
            raise ValueError(f"{words[at]} is there twice")
        header[words[at].lower()] = float(words[at + 1])
    missing = [key for key in ("ncols", "nrows", "cellsize") if key not in header]
    if missing:
        raise ValueError(f"{', '.join(missing)} are missing")
    heights_m = np.array(words[2 * len(header) :], float)
    width, rows, resolution_m = int(header["ncols"]), int(header["nrows"]), header["cellsize"]
    if len(heights_m) != width * rows:
        raise ValueError(f"{width} times {rows} heights are announced, and {len(heights_m)} there")
    heights_m[heights_m == header.get("nodata_value", -9999.0)] = np.nan
    east_m, north_m = (
        header[f"{axis}llcenter"]
        if f"{axis}llcenter" in header
        else header[f"{axis}llcorner"] + resolution_m / 2.0
        for axis in ("x", "y")
    )
    return TerrainGrid(
        (east_m, north_m), resolution_m, width, heights_m.reshape(rows, width)[::-1].ravel()
    )


def _read_numpy(path: Path) -> TerrainGrid:
    with np.load(path, allow_pickle=False) as stored:
        heights_m = np.asarray(stored["heights"], float)
        east_m, north_m = (float(value) for value in stored["origin"])
        resolution_m = float(stored["resolution"])
    if heights_m.ndim != 2:
        raise ValueError(f"heights have {heights_m.ndim} dimensions instead of 2")
    return TerrainGrid((east_m, north_m), resolution_m, heights_m.shape[1], heights_m.ravel())
