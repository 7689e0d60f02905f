"""Reports of other aircraft: asked for, by address or without one, one's own echo left out."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, Message, mavlink
from navigation_bridge.configuration.make_config import make_config
from navigation_core.geometry import Vector3
from tests.fleets.encounters import adsb, begin, hear
from tests.fleets.flown import FlownFleet, homes

pytestmark = pytest.mark.timeout(600)
_RECEIVER = 156  # MAV_COMP_ID_ADSB
_SOUND = mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE


def known(fleet: FlownFleet) -> dict[str, tuple[float, float]]:
    """Return where other traffic is, east and north of the home, by its name there."""
    shared, home = fleet.traffic[0], fleet.simulation.vehicles[0].frame.to_geodetic(0.0, 0.0, 0.0)
    assert shared.earth is not None
    here = shared.earth.metres((home.latitude_deg, home.longitude_deg, home.altitude_amsl_m))
    places = {}
    for other in shared.reservations.others(fleet.crafts[0].name):
        east, north, _ = (other.held.points_m[0] - here).tolist()
        places[other.name] = (round(east, -1), round(north, -1))
    return places


def report(
    fleet: FlownFleet, *messages: Callable[[float], Message], period_s: float = 1.0
) -> Callable[[float], None]:
    """Return a tick that has the fleet hear messages about the present state."""

    def tick(now: float) -> None:
        if round(now / 0.02) % round(period_s / 0.02) == 0:
            for make_message in messages:
                hear(fleet, make_message(now))

    return tick


def echo(fleet: FlownFleet, offset_m: Vector3 = (2.0, -1.0, 1.0)) -> Callable[[float], Message]:
    """Return reports of the vehicle's own transponder, without and with a second's delay."""
    truth: list[tuple[Vector3, Vector3]] = []

    def make_message(_: float) -> Message:
        north, east, down = fleet.simulation.positions_ned_m[0].tolist()
        v_north, v_east, v_down = fleet.simulation.truth.velocity_ned_m_s[0].tolist()
        x, y, z = offset_m
        truth.append(((east + x, north + y, z - down), (v_east, v_north, -v_down)))
        return adsb(fleet, *truth[-2:][0], 0x4B1A2C)

    return make_message


@pytest.mark.parametrize(
    ("autopilot", "parameters"), [("ardupilot", {"ADSB_TYPE": 1.0}), ("px4", {})]
)
def test_what_the_vehicles_receiver_hears_is_asked_for(
    autopilot: str, parameters: dict[str, float]
) -> None:
    config = VehicleConfig(autopilot=autopilot, ready_after_s=1.0, parameters=parameters)
    fleet = FlownFleet([config]).ready()
    receiver, link = Codec(1, _RECEIVER), fleet.simulation.vehicles[0].link

    def fly(now: float) -> None:
        if round(now / 0.02) % 50 == 0:
            for index in range(3):
                place = (300.0 + 50.0 * index, 100.0, 40.0)
                link.write(receiver.encode(adsb(fleet, place, (0.0,) * 3, 0x100 + index)))

    fleet.on_tick = fly
    fleet.run_for(6.0)
    assert known(fleet) == {
        "ICAO 000100": (300.0, 100.0),
        "ICAO 000101": (350.0, 100.0),
        "ICAO 000102": (400.0, 100.0),
    }


def test_an_ardupilot_sends_no_aircraft_before_it_is_asked_or_without_a_receiver() -> None:
    for asked, adsb_type, expected in ((False, 1.0, 0), (True, 0.0, 0), (True, 1.0, 6)):
        config = VehicleConfig(ready_after_s=1.0, parameters={"ADSB_TYPE": adsb_type})
        separation = "enabled" if asked else "disabled"
        fleet = FlownFleet([config], separation=separation).ready()
        station, link = Codec(1, _RECEIVER), fleet.simulation.vehicles[0].link
        begun_s, heard = fleet.now, 0
        while fleet.now < begun_s + 3.0:
            if round(fleet.now / 0.02) % 25 == 0:
                for index in range(2):
                    link.write(
                        station.encode(adsb(fleet, (300.0, 0.0, 40.0), (0.0,) * 3, 1 + index))
                    )
            fleet.now += 0.02
            fleet.simulation.run_for(0.02)
            for data in link.read_datagrams():
                names = [message.get_type() for message in station.decode(data)]
                heard += names.count("ADSB_VEHICLE")
        assert abs(heard - expected) <= (2 if expected else 0)


def test_no_aircraft_are_asked_for_without_separation() -> None:
    assert "ADSB_VEHICLE" in make_config({}).vehicle.optional_rates_hz
    off = make_config({"separation": "disabled"})
    assert "ADSB_VEHICLE" not in off.vehicle.optional_rates_hz


def test_targets_without_an_address_stay_apart_and_are_followed() -> None:
    fleet = begin(height_m=5.0)

    def moving(now: float) -> Message:
        return adsb(fleet, (-100.0, 8.0 * now - 200.0, 5.0), (0.0, 8.0, 0.0), 0)

    fleet.on_tick = report(
        fleet,
        lambda _: adsb(fleet, (100.0, 0.0, 5.0), (0.0,) * 3, 0),
        lambda _: adsb(fleet, (130.0, 0.0, 5.0), (0.0,) * 3, 0),
        moving,
        lambda _: adsb(fleet, (100.0, 0.0, 5.0), (0.0,) * 3, 0, callsign=b"OTHER"),
    )
    fleet.run_for(12.0)
    north_m = round(8.0 * fleet.now - 200.0, -1)
    places = sorted(known(fleet).values())
    assert places[1:] == [(100.0, 0.0), (100.0, 0.0), (130.0, 0.0)]
    assert places[0][0] == -100.0
    assert abs(places[0][1] - north_m) <= 10.0


@pytest.mark.night
def test_nobody_is_flown_to_who_has_no_address() -> None:
    # The near one is where the goal leads; the far one had its name.
    fleet = begin(height_m=5.0)
    (craft,) = fleet.crafts
    fleet.on_tick = report(
        fleet,
        lambda _: adsb(fleet, (40.0, 0.0, 5.0), (0.0,) * 3, 0),
        lambda _: adsb(fleet, (400.0, 0.0, 5.0), (0.0,) * 3, 0),
    )
    fleet.run_for(3.0)
    fleet.go(craft, 40.0, 0.0, 5.0)
    end_s, nearest_m = fleet.now + 30.0, math.inf
    while fleet.now < end_s:
        fleet.tick()
        north_m, east_m, _ = fleet.simulation.positions_ned_m[0].tolist()
        nearest_m = min(nearest_m, math.hypot(east_m - 40.0, north_m))
    assert nearest_m > 30.0


def test_its_own_echo_does_not_keep_it_on_the_ground() -> None:
    fleet = FlownFleet([VehicleConfig(ready_after_s=1.0)]).ready()
    (craft,) = fleet.crafts
    fleet.on_tick = report(fleet, echo(fleet))
    fleet.run_for(3.0)
    fleet.go(craft, 40.0, 0.0, 10.0)
    fleet.run_for(4.0)
    assert not fleet.crafts[0].bridge.vehicle.state.armed  # not recognised yet
    fleet.run_to_end(90.0)
    assert craft.ends()[-1][1].code.value == "SUCCESS"


def test_its_own_address_is_known_at_once() -> None:
    fleet = FlownFleet([VehicleConfig(ready_after_s=1.0)], adsb_address="4b1a2c").ready()
    fleet.on_tick = report(fleet, echo(fleet, (15.0, 0.0, 40.0)))
    fleet.run_for(3.0)
    assert not known(fleet)


@pytest.mark.night
def test_an_echo_with_another_altitude_is_known_by_its_climb() -> None:
    fleet = begin(height_m=5.0)
    (craft,) = fleet.crafts
    fleet.on_tick = report(fleet, echo(fleet, (1.0, 1.0, 45.0)))
    fleet.run_for(15.0)
    assert known(fleet)
    fleet.go(craft, 0.0, 0.0, 30.0)
    fleet.run_for(25.0)
    assert not known(fleet)


@pytest.mark.wide
@pytest.mark.parametrize("offset_m", [(6.0, 0.0, 0.0), (0.0, 0.0, 6.0), (0.0, 9.0, 3.0)])
def test_another_vehicle_that_hovers_near_is_no_echo(offset_m: Vector3) -> None:
    fleet = FlownFleet([VehicleConfig(ready_after_s=1.0)]).ready()
    (craft,) = fleet.crafts
    fleet.on_tick = report(fleet, lambda _: adsb(fleet, offset_m, (0.0,) * 3))
    fleet.run_for(3.0)
    fleet.go(craft, 40.0, 0.0, 10.0)
    fleet.run_for(60.0)
    assert "ICAO ABCDEF" in known(fleet)
    assert not craft.bridge.vehicle.state.armed


def test_one_that_was_taken_for_an_echo_is_traffic_again_once_it_stays_behind() -> None:
    fleet = begin(height_m=5.0)
    (craft,) = fleet.crafts
    fleet.on_tick = report(fleet, lambda _: adsb(fleet, (0.0, 0.0, 5.0), (0.0,) * 3))
    fleet.run_for(15.0)
    assert not known(fleet)
    fleet.go(craft, 60.0, 0.0, 5.0)
    fleet.run_for(12.0)
    assert "ICAO ABCDEF" in known(fleet)


def test_what_we_announce_does_not_come_back_as_traffic() -> None:
    places = [(0.0, 0.0), (15.0, 0.0)]
    configs = [
        VehicleConfig(home=home, ready_after_s=1.0, parameters={"ADSB_TYPE": 1.0})
        for home in homes(places)
    ]
    fleet = FlownFleet(configs, announce_adsb="enabled").ready()
    fleet.run_for(5.0)
    sent = [craft.bridge.vehicle.rates.refusal("ADSB_VEHICLE") for craft in fleet.crafts]
    assert sent == [None, None]
    assert set(fleet.traffic[0].reservations.entries) == {"v00", "v01"}


@pytest.mark.parametrize(
    "fields",
    [
        {"flags": 0},
        {"flags": _SOUND - 1},
        {"lat": 0, "lon": 0},
        {"lat": 2**31 - 1},
        {"altitude": 2**31 - 1},
        {"tslc": 200},
    ],
)
def test_a_report_that_cannot_be_is_ignored(fields: dict[str, int]) -> None:
    fleet = FlownFleet([VehicleConfig(ready_after_s=1.0)]).ready()
    hear(fleet, adsb(fleet, (100.0, 0.0, 20.0), (5.0, 0.0, 0.0), **fields))
    assert not known(fleet)


@pytest.mark.parametrize("fields", [{"flags": _SOUND}, {"heading": 65535}, {"hor_velocity": 65535}])
def test_a_velocity_that_is_not_valid_is_derived(fields: dict[str, int]) -> None:
    fleet = FlownFleet([VehicleConfig(ready_after_s=1.0)]).ready()
    fleet.on_tick = report(
        fleet, lambda now: adsb(fleet, (100.0 + 10.0 * now, 50.0, 20.0), (0.0,) * 3, **fields)
    )
    fleet.run_for(5.0)
    ((_, intruder),) = fleet.traffic[0].reservations.intruders("v00")
    assert intruder.velocity_m_s[0] == pytest.approx(10.0, abs=0.3)


def test_an_old_report_is_carried_on() -> None:
    fleet = FlownFleet([VehicleConfig(ready_after_s=1.0)]).ready()
    hear(fleet, adsb(fleet, (100.0, 0.0, 20.0), (20.0, 0.0, 0.0), tslc=5))
    assert known(fleet) == {"ICAO ABCDEF": (200.0, 0.0)}


def test_thousands_of_targets_far_away_cost_little_and_hide_nobody_near() -> None:
    fleet = begin(height_m=5.0)
    for index in range(3000):
        place = (20e3 + 10.0 * index, 5e3, 3000.0)
        hear(fleet, adsb(fleet, place, (-200.0, 0.0, 0.0), 0x200000 + index))
    hear(fleet, adsb(fleet, (100.0, 0.0, 5.0), (5.0, 0.0, 0.0)))
    fleet.run_for(1.0)
    assert set(known(fleet)) == {"ICAO ABCDEF"}
