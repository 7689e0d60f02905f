"""Colours and files of the pictures in docs that show flights, for the scripts that draw them."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

__all__ = ["COLOURS", "save_picture"]

COLOURS = {"ardupilot": "tab:blue", "px4": "tab:orange"}
"""Colours of the firmwares."""
_PALETTE = 64


def save_picture(figure: Figure, path: Path) -> None:
    """Write a figure with few colours, which makes a small file."""
    figure.savefig(path, dpi=100)
    with Image.open(path) as image:
        image.convert("RGB").quantize(_PALETTE).save(path, optimize=True)
