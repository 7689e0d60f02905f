"""The status of a link to ground stations is reported."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest

from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.io.links.tcp import MAX_CLIENTS
from mavlink_vehicle.io.links.udp import MAX_PEERS, PEER_EXPIRY_S
from mavlink_vehicle.io.ports import NEIGHBOUR_FRAMES_HZ, STATION_BURST, STATION_FRAMES_HZ
from mavlink_vehicle.io.router import STATION_COPIES_HZ, VEHICLE_COPIES_HZ
from mavlink_vehicle.io.routes import ROUTE_EXPIRY_S
from navigation_bridge.vehicle.station_health import COUNTS, StationHealth

ROOT = Path(__file__).resolve().parents[3]


def test_every_count_has_a_label() -> None:
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
        ("spoofed", "vehicle's system id"),
        ("throttled", "rate limit"),
        ("withheld", "forwarded"),
        ("badly_signed", "Wrongly signed"),
        ("unsigned", "Unsigned"),
        ("replayed", "Replayed"),
        ("bad_crc", "corrupted"),
    ],
)
def test_trouble_is_reported_while_it_lasts(name: str, words: str) -> None:
    health, statistics = StationHealth(), LinkStatistics()
    health.update(statistics)
    assert (health.trouble, health.message) == ("", "Silent")
    setattr(statistics, name, 5)
    health.update(statistics)
    assert words in health.trouble == health.message
    statistics.frames += 1
    health.update(statistics)
    assert (health.trouble, health.message) == ("", "Ground stations connected")


def test_the_page_names_every_count_and_the_limits() -> None:
    page = (ROOT / "docs/ground_stations.md").read_text("utf-8")
    for words in COUNTS.values():
        assert words.removesuffix(" since start") in page, words
    limits = (STATION_FRAMES_HZ, STATION_BURST, NEIGHBOUR_FRAMES_HZ)
    assert all(f"{limit:.0f}" in page for limit in (*limits, STATION_COPIES_HZ, VEHICLE_COPIES_HZ))
    assert all(str(number) in page for number in (MAX_PEERS, MAX_CLIENTS))
    assert f"{ROUTE_EXPIRY_S:.0f} s" in page
    assert PEER_EXPIRY_S == ROUTE_EXPIRY_S
