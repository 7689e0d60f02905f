"""Libraries of the pages are unchanged files of their packages, and the pages stay small."""

from __future__ import annotations

import hashlib
from importlib.resources import files
from pathlib import Path

import pytest

REPORT = Path(str(files("flight_reports") / "page"))
CONSOLE = Path(str(files("drone_navigation") / "console/page"))
CONSOLE_MAX_BYTES = 1_500_000
# Of the npm packages leaflet 1.9.4 and plotly.js-basic-dist-min 4.1.1.
SHA256 = {
    "map/leaflet.js": "db49d009c841f5ca34a888c96511ae936fd9f5533e90d8b2c4d57596f4e5641a",
    "map/leaflet.css": "a7837102824184820dfa198d1ebcd109ff6d0ff9a2672a074b9a1b4d147d04c6",
    "map/leaflet.LICENSE.txt": "53e8dc25862014e4324741ca18fbe3611e11d42ef69f59f86ea8c5389647d4cb",
    "plotly-basic.min.js": "99784e3abfb07b142a15e521a439e6d9addceadb3f79553fd24c72774f0649ba",
}


@pytest.mark.parametrize("name", SHA256)
def test_a_library_is_the_unchanged_file_of_its_package(name: str) -> None:
    assert hashlib.sha256((REPORT / name).read_bytes()).hexdigest() == SHA256[name]


def test_each_library_has_its_licence() -> None:
    for script in [*REPORT.rglob("leaflet.js"), *REPORT.rglob("plotly*.js")]:
        name = script.name.removesuffix(".js").removesuffix(".min")
        assert "Copyright" in (script.parent / f"{name}.LICENSE.txt").read_text("utf-8")


def test_the_console_is_below_one_and_a_half_megabytes() -> None:
    served = [*CONSOLE.iterdir(), *(REPORT / "map").iterdir()]
    assert 100_000 < sum(file.stat().st_size for file in served) < CONSOLE_MAX_BYTES
