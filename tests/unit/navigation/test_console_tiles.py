"""Tiles of a folder and of a PMTiles archive, and what is wrong with others."""

from __future__ import annotations

import random
import struct
from pathlib import Path

import pytest
from pmtiles.tile import TileType

from drone_navigation.console.options import make_parser
from drone_navigation.console.tiles.folder import TileError, media_type, tile_of
from drone_navigation.console.tiles.source import open_tiles
from tests.support.tiles import TileKey, draw_tiles, write_archive, write_folder

PLACE = (52.0, 13.0)


@pytest.fixture(scope="module")
def tiles() -> dict[TileKey, bytes]:
    return {**draw_tiles([PLACE], 12), **draw_tiles([PLACE], 14)}


@pytest.mark.parametrize("kind", ["folder", "archive"])
def test_each_tile_is_read_and_a_gap_is_none(
    tiles: dict[TileKey, bytes], kind: str, tmp_path: Path
) -> None:
    if kind == "folder":
        found = open_tiles(write_folder(tiles, tmp_path))
    else:
        found = open_tiles(write_archive(tiles, tmp_path / "a.pmtiles"))
    assert (found.zoom_min, found.zoom_max) == (12, 14)
    for key, content in tiles.items():
        assert found.read(*key) == content
    assert found.read(13, 0, 0) is None
    assert found.read(12, 0, 0) is None


def test_an_archive_with_leaf_directories_is_read(tmp_path: Path) -> None:
    rng = random.Random(5)
    many = {(9, x, y): rng.randbytes(rng.randrange(4, 400)) for x in range(140) for y in range(140)}
    found = open_tiles(write_archive(many, tmp_path / "a.pmtiles"))
    header = (tmp_path / "a.pmtiles").read_bytes()[:127]
    assert struct.unpack_from("<Q", header, 48)[0] > 0  # bytes of the leaves
    for key in ((9, 0, 0), (9, 139, 139), (9, 77, 3)):
        assert found.read(*key) == many[key]
    assert found.read(9, 140, 0) is None


def changed(path: Path, at: int, new: bytes) -> None:
    whole = bytearray(path.read_bytes())
    whole[at : at + len(new)] = new
    path.write_bytes(whole)


@pytest.mark.parametrize(
    ("at", "new", "sentence"),
    [
        (0, b"SQLite", "neither a folder of tiles nor a PMTiles archive"),
        (7, b"\x02", "version 2; only 3"),
        (97, b"\x01", "not compressed by gzip"),
        (99, b"\x01", "MVT tiles; only PNG, JPEG and WebP"),
        (99, b"\x63", "tiles of an unknown kind"),
        (127, b"\x00\x00\x00", "its directory cannot be read"),
        (16, b"\xff" * 8, "its directory cannot be read"),
    ],
)
def test_an_archive_that_cannot_be_drawn_is_rejected_with_its_reason(
    tiles: dict[TileKey, bytes], at: int, new: bytes, sentence: str, tmp_path: Path
) -> None:
    path = write_archive(tiles, tmp_path / "a.pmtiles")
    changed(path, at, new)
    with pytest.raises(TileError, match=sentence):
        open_tiles(path)


def test_what_is_no_archive_and_no_folder_of_tiles_is_rejected(
    tiles: dict[TileKey, bytes], tmp_path: Path
) -> None:
    path = write_archive(tiles, tmp_path / "a.pmtiles", TileType.MVT)
    for cut, sentence in ((100, "truncated"), (140, "directory cannot be read")):
        (tmp_path / "cut.pmtiles").write_bytes(
            write_archive(tiles, tmp_path / "b.pmtiles").read_bytes()[:cut]
        )
        with pytest.raises(TileError, match=sentence):
            open_tiles(tmp_path / "cut.pmtiles")
    with pytest.raises(TileError, match="MVT"):
        open_tiles(path)
    with pytest.raises(TileError, match="no folders named by zoom"):
        open_tiles(tmp_path)
    with pytest.raises(TileError, match="No such file"):
        open_tiles(tmp_path / "absent")
    (tmp_path / "empty").touch()
    with pytest.raises(TileError, match="neither"):
        open_tiles(tmp_path / "empty")


def test_an_archive_that_is_cut_short_later_has_gaps(
    tiles: dict[TileKey, bytes], tmp_path: Path
) -> None:
    path = write_archive(tiles, tmp_path / "a.pmtiles")
    found = open_tiles(path)
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size // 2)
    read = [found.read(*key) for key in tiles]
    assert None in read
    assert all(content in (None, tiles[key]) for key, content in zip(tiles, read, strict=True))


@pytest.mark.parametrize(
    ("path", "tile"),
    [
        ("/tile/14/3/16383", (14, 3, 16383)),
        ("/tile/0/0/0", (0, 0, 0)),
        ("/tile/14/3/16384", None),
        ("/tile/25/0/0", None),
        ("/tile/-1/0/0", None),
        ("/tile/1/0", None),
        ("/tile/1/0/../../secret", None),
        ("/tile/1/0/%2e%2e", None),
        ("/tile/1/0/0.png", None),
        ("/tile/1/0/0/", None),
        ("/tile/\N{ARABIC-INDIC DIGIT ONE}/0/0", None),
        ("/tile/1//0", None),
        ("/tile/999999999999999/0/0", None),
    ],
)
def test_only_numbers_name_a_tile(path: str, tile: tuple[int, int, int] | None) -> None:
    assert tile_of(path) == tile


def test_a_link_does_not_lead_out_of_the_folder(
    tiles: dict[TileKey, bytes], tmp_path: Path
) -> None:
    secret = tmp_path / "secret.png"
    secret.write_bytes(next(iter(tiles.values())))
    folder = write_folder(tiles, tmp_path / "tiles")
    (folder / "12" / "1").mkdir()
    (folder / "12" / "1" / "1.png").symlink_to(secret)
    (folder / "12" / "1" / "2.png").symlink_to(folder / "12" / "1" / "2.png")
    found = open_tiles(folder)
    assert found.read(12, 1, 1) is None
    assert found.read(12, 1, 2) is None


def test_only_images_have_a_media_type(tiles: dict[TileKey, bytes]) -> None:
    assert media_type(next(iter(tiles.values()))) == "image/png"
    assert media_type(b"\xff\xd8\xff\xe0") == "image/jpeg"
    assert media_type(b"RIFF\0\0\0\0WEBP") == "image/webp"
    for other in (b"", b"<svg onload=", b"<html>", b"\x1f\x8b", b"RIFF\0\0\0\0WAVE"):
        assert media_type(other) is None


def test_tiles_are_an_option() -> None:
    assert make_parser().parse_args(["--tiles", "a"]).tiles == Path("a")
    assert make_parser().parse_args([]).tiles is None
