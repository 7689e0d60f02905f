"""What people are told of a link to ground stations."""

from __future__ import annotations

from dataclasses import fields

import pytest

from drone_navigation.station_health import COUNTS, StationHealth
from mavlink_vehicle.io.endpoints import LinkStatistics


def test_every_count_has_words_for_people() -> None:
    names = {field.name for field in fields(LinkStatistics)} - {"lost"} | {"lost_total"}
    assert set(COUNTS) == names
    health = StationHealth()
    health.update(LinkStatistics(frames=3, lost={(255, 190): 2}))
    assert health.values["messages received since start"] == "3"
    assert health.values["lost since start"] == "2"
    assert len(health.values) == len(COUNTS)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("spoofed", "in the name of a vehicle"),
        ("throttled", "too much"),
        ("withheld", "passed on"),
        ("badly_signed", "Wrongly signed"),
        ("unsigned", "Unsigned"),
        ("replayed", "Replayed"),
        ("bad_crc", "damaged"),
    ],
)
def test_trouble_is_told_while_it_lasts(name: str, words: str) -> None:
    health, statistics = StationHealth(), LinkStatistics()
    health.update(statistics)
    assert (health.trouble, health.message) == ("", "Silent")
    setattr(statistics, name, 5)
    health.update(statistics)
    assert words in health.trouble == health.message
    statistics.frames += 1
    health.update(statistics)
    assert (health.trouble, health.message) == ("", "Ground stations are heard")
