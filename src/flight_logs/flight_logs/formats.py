"""The file formats of an export."""

from __future__ import annotations

from enum import Enum


class Format(Enum):
    """The file format; the value is also the file extension."""

    PARQUET = "parquet"
    CSV = "csv"
