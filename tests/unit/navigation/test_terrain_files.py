"""Files of terrain that the client reads, and those that it rejects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drone_navigation.client.option_groups.terrain_file import TerrainFileError, read_terrain

HEADER = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner -20\ncellsize 4\nNODATA_value -99\n"


def test_an_ascii_grid_is_read_from_the_south(tmp_path: Path) -> None:
    file = tmp_path / "hill.asc"
    file.write_text(f"{HEADER}4 5 6\n1 -99 3\n")
    grid = read_terrain(file)
    assert (grid.origin_enu_m, grid.resolution_m, grid.width) == ((12.0, -18.0), 4.0, 3)
    np.testing.assert_array_equal(grid.heights_m, [1.0, np.nan, 3.0, 4.0, 5.0, 6.0])
    file.write_text(f"{HEADER}4 5 6\n1 2 3\n".replace("corner", "center"))
    assert read_terrain(file).origin_enu_m == (10.0, -20.0)


def test_an_archive_is_read_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "hill.npz"
    np.savez(file, heights=[[1.0, 2.0], [3.0, 4.0]], origin=[5.0, 6.0], resolution=2.5)
    grid = read_terrain(file)
    assert (grid.origin_enu_m, grid.resolution_m, grid.width) == ((5.0, 6.0), 2.5, 2)
    assert grid.heights_m.tolist() == [1.0, 2.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("none.asc", None, "cannot be read"),
        ("hill.tif", "", "give .asc"),
        ("empty.asc", "", "not a valid grid"),
        ("short.asc", f"{HEADER}1 2 3", "3 times 2 heights are announced, and 3 there"),
        ("twice.asc", f"ncols 3 {HEADER}", "twice"),
        ("endless.asc", f"{HEADER}1".replace("ncols 3", "ncols inf"), "not a valid grid"),
        ("headless.asc", "1 2 3", "ncols, nrows, cellsize are missing"),
        ("words.asc", f"{HEADER}a b c d e f", "not a valid grid"),
        ("binary.asc", "\xff", "not a valid grid"),
        ("text.npz", "heights", "not a valid grid"),
        ("empty.npz", "", "not a valid grid"),
    ],
)
def test_what_is_no_terrain_is_rejected_with_a_sentence(
    name: str, text: str | None, reason: str, tmp_path: Path
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text, encoding="latin-1")
    with pytest.raises(TerrainFileError, match=reason):
        read_terrain(tmp_path / name)


def test_an_archive_without_one_of_its_arrays_is_rejected(tmp_path: Path) -> None:
    np.savez(tmp_path / "hill.npz", heights=np.ones((2, 2)), origin=np.zeros(2))
    with pytest.raises(TerrainFileError, match="resolution"):
        read_terrain(tmp_path / "hill.npz")


def test_heights_of_an_archive_that_are_no_table_are_rejected(tmp_path: Path) -> None:
    np.savez(tmp_path / "hill.npz", heights=np.ones(4), origin=np.zeros(2), resolution=1.0)
    with pytest.raises(TerrainFileError, match="1 dimensions instead of 2"):
        read_terrain(tmp_path / "hill.npz")
