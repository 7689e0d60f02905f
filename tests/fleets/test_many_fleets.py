"""Broad: many seeds, mixed kinds, and servers that are cut off from each other."""

from __future__ import annotations

import pytest

from mavlink_sitl import VehicleConfig
from tests.fleets.__main__ import RATIO_MAX, fly
from tests.fleets.flown import CONDITIONS, FlownFleet, flown_crossing, homes
from tests.fleets.test_crossing import codes, copters, cross, on_a_circle

pytestmark = [pytest.mark.night, pytest.mark.timeout(1500)]


@pytest.mark.parametrize("seed", [*range(8), 534])
def test_twenty_copters_cross(seed: int) -> None:
    _, ratio, _, fault = fly((seed, 20, 100.0, ""))
    assert not fault, fault
    # Of one scenario; the command judges the mean of all.
    assert ratio <= RATIO_MAX + 0.2


@pytest.mark.parametrize(("seed", "conditions"), list(enumerate(CONDITIONS)))
def test_eight_simulated_copters_cross(seed: int, conditions: str) -> None:
    ratio, _, fault = flown_crossing(seed, 8, 60.0, CONDITIONS[conditions])
    assert not fault, fault
    assert ratio <= RATIO_MAX + 0.2


def test_mixed_kinds_cross() -> None:
    places = on_a_circle(6, 25.0)
    kinds = (
        ("copter", "ardupilot"), ("rover", "ardupilot"), ("copter", "px4"),
        ("rover", "px4"), ("boat", "ardupilot"), ("rover", "ardupilot"),
    )  # fmt: skip
    vehicles = [
        VehicleConfig(vehicle=kind, autopilot=firmware, home=home, ready_after_s=1.0)
        for (kind, firmware), home in zip(kinds, homes(places), strict=True)
    ]
    fleet = FlownFleet(vehicles).ready()
    with fleet.holding():
        for craft, (east, north), (kind, _) in zip(fleet.crafts, places, kinds, strict=True):
            height_m = 5.0 if kind == "copter" else 0.0
            fleet.go(craft, -east - places[0][0], -north - places[0][1], height_m)
        fleet.run_to_end(400.0)
    assert codes(fleet) == ["SUCCESS"] * 6, fleet.report()


def test_planes_circle_to_wait_for_each_other() -> None:
    places = [(0.0, 0.0), (0.0, -800.0)]  # both take off northwards
    vehicles = [
        VehicleConfig(vehicle="plane", home=home, ready_after_s=1.0) for home in homes(places)
    ]
    fleet = FlownFleet(vehicles, volume_radius_m=3000.0, battery_policy="ignore").ready()
    fleet.run_for(1.0)
    first, second = fleet.crafts
    with fleet.holding():
        fleet.go(first, 600.0, 0.0, 80.0)
        fleet.run_until(lambda: bool(first.ends()), 300.0)
        fleet.go(second, 600.0, 30.0, 80.0)
        fleet.run_until(lambda: "WAITING_FOR_TRAFFIC" in second.statuses(), 300.0)
        fleet.go(first, -600.0, 0.0, 80.0)
        fleet.run_to_end(600.0)
    assert codes(fleet) == ["SUCCESS"] * 3, fleet.report()


def test_a_server_that_dies_in_the_middle_keeps_its_volume_closed() -> None:
    places = on_a_circle(4)
    fleet = FlownFleet(copters(places), servers=[0, 0, 1, 1]).ready()
    fleet.join()
    with fleet.holding():
        cross(fleet, places)
        fleet.run_until(lambda: fleet.now > 20.0, 60.0)
        fleet.dead.add(1)
        fleet.run_for(150.0)
    ended = [end.code.value for craft in fleet.crafts[:2] for _, end in craft.ends()]
    assert set(ended) <= {"SUCCESS", "TRAFFIC"}


@pytest.mark.parametrize("cut_s", [8.0, 16.0, 22.0])
def test_a_cut_network_between_two_servers_joins_no_two_vehicles(cut_s: float) -> None:
    places = on_a_circle(4)
    fleet = FlownFleet(copters(places), servers=[0, 1, 0, 1]).ready()
    fleet.join()
    with fleet.holding():
        cross(fleet, places)
        fleet.run_until(lambda: fleet.now > cut_s, 60.0)
        fleet.cut = True
        fleet.run_for(30.0)
        fleet.cut = False
        fleet.run_to_end(400.0)
    assert codes(fleet) == ["SUCCESS"] * 4, fleet.report()
