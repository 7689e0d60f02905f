"""Fence, rally points and mission of a simulated vehicle, read and placed in the map."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import PlanItem, PlanType, VehicleConfig
from mavlink_vehicle.codec import make, with_source
from navigation_bridge.scene import SceneFence, SceneItem
from navigation_core.safety.fences import CircleArea, PolygonArea
from tests.support.flights.simulated_flight import SimulatedFlight
from tests.support.flights.station_flight import TARGET, StationFlight
from tests.support.stations.missions import position_1e7

pytestmark = pytest.mark.wide_but_first


_SQUARE = ((-60.0, -60.0), (-60.0, 60.0), (60.0, 60.0), (60.0, -60.0))
_IDENTITY = 77


def planned(
    command: int, north_m: float, east_m: float, up_m: float = 0.0, *, first: float = 0.0,
    frame: int = 3,
) -> PlanItem:  # fmt: skip
    place = position_1e7(north_m, east_m)
    return PlanItem(command, frame, (first, 0.0, 0.0, 0.0), *place, up_m)


def with_lists(autopilot: str) -> SimulatedFlight:
    """A vehicle that has had all three lists since before we came."""
    flight = SimulatedFlight(simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0))
    vehicle = flight.simulation.vehicles[0]
    if autopilot == "ardupilot":
        vehicle.parameters.set("FENCE_ENABLE", 1.0)
        vehicle.parameters.set("FENCE_TYPE", 5.0)
        vehicle.parameters.set("FENCE_ALT_MAX", 40.0)
    plans = vehicle.firmware.plans
    corners = [planned(5001, n, e, first=4.0, frame=0) for n, e in _SQUARE]
    plans.fence.replace([*corners, planned(5004, 0.0, 30.0, first=8.0, frame=0)], 1)
    plans.rally.replace([planned(5100, 20.0, -10.0, 15.0)], 1)
    home = [planned(16, 0.0, 0.0, frame=0)] if autopilot == "ardupilot" else []
    mission = [
        planned(16, 10.0, 5.0, 12.0, first=3.0),
        PlanItem(178, 3 if home else 2, (0.0, 4.0, 0.0, 0.0)),
        planned(16, 30.0, 5.0, 600.0, frame=0),
        PlanItem(20, 3 if home else 2),
    ]
    plans.mission.replace([*home, *mission], _IDENTITY)
    flight.ready()
    flight.run_until(lambda: flight.vehicle.stored_lists.mission is not None, 20.0)
    return flight


def fence(flight: SimulatedFlight) -> SceneFence:
    shown = flight.bridge.scene.fence()
    assert shown is not None
    return shown


def mission(flight: SimulatedFlight) -> tuple[SceneItem, ...]:
    shown = flight.bridge.scene.mission()
    assert shown is not None
    return shown


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_what_the_vehicle_stores_is_read_and_placed(autopilot: str) -> None:
    flight = with_lists(autopilot)
    square, circle = (shown.area for shown in fence(flight).areas)
    assert isinstance(square, PolygonArea)
    assert isinstance(circle, CircleArea)
    assert square.inclusion
    assert not circle.inclusion
    for corner, (north_m, east_m) in zip(square.corners_enu_m, _SQUARE, strict=True):
        assert corner == pytest.approx((east_m, north_m), abs=0.5)
    assert circle.centre_enu_m == pytest.approx((30.0, 0.0), abs=0.3)
    assert all(shown.in_force for shown in fence(flight).areas)
    (latitude_deg, _), *_ = fence(flight).areas[0].corners_deg
    assert latitude_deg == pytest.approx(planned(5001, -60.0, 0.0).x * 1e-7, abs=1e-9)
    if autopilot == "ardupilot":
        assert fence(flight).altitude_max_m == 40.0
        assert math.isnan(fence(flight).altitude_min_m)

    (rally,) = flight.bridge.scene.rally_points() or ()
    assert rally.position_enu_m == pytest.approx((-10.0, 20.0, 15.0), abs=0.3)

    items = mission(flight)
    first = 1 if autopilot == "ardupilot" else 0
    assert [shown.number for shown in items] == list(range(first, first + 4))
    assert [shown.item.command for shown in items] == [16, 178, 16, 20]
    assert items[0].position_enu_m == pytest.approx((5.0, 10.0, 12.0), abs=0.3)
    home = flight.vehicle.state.home
    assert home is not None
    above_m = 600.0 - home.altitude_amsl_m
    assert items[2].position_enu_m == pytest.approx((5.0, 30.0, above_m), abs=0.5)
    assert all(map(math.isnan, (*items[1].position_enu_m, *items[3].position_enu_m)))


def test_a_fence_that_is_switched_off_is_shown_as_stored_only() -> None:
    flight = with_lists("ardupilot")
    flight.simulation.vehicles[0].parameters.set("FENCE_ENABLE", 0.0)
    flight.run_until(lambda: not fence(flight).areas[0].in_force, 90.0)
    assert len(fence(flight).areas) == 2
    assert math.isnan(fence(flight).altitude_max_m)


@pytest.mark.parametrize("listed", [PlanType.FENCE, PlanType.RALLY, PlanType.MISSION])
def test_mission_current_of_a_px4_shows_another_list_at_once(listed: PlanType) -> None:
    """The change came on a link that we do not hear."""
    flight = with_lists("px4")
    flight.run_for(5.0)
    flight.simulation.vehicles[0].firmware.plans.of(listed).replace([], 0)
    vehicle = flight.vehicle
    read = {
        PlanType.FENCE: lambda: vehicle.stored_lists.fence == (),
        PlanType.RALLY: lambda: vehicle.stored_lists.rally_points == (),
        PlanType.MISSION: lambda: vehicle.stored_lists.mission == (),
    }
    flight.run_until(read[listed], 3.0)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("seen", [True, False])
def test_a_mission_that_a_station_uploads_while_we_read_is_taken_and_then_read(
    autopilot: str, seen: bool
) -> None:
    flight = StationFlight(autopilot, "copter")
    flight.run_for(10.0)
    flight.upload(3, seen=seen)
    plans = flight.simulation.vehicles[0].firmware.plans
    assert len(plans.mission.items) == 3
    flight.run_until(lambda: bool(flight.vehicle.stored_lists.mission), 15.0)
    flight.run_for(5.0)
    expected = 2 if autopilot == "ardupilot" else 3  # the first is an ArduPilot's home
    assert len(flight.vehicle.stored_lists.mission or ()) == expected


def test_a_mission_of_our_own_is_known_without_reading_it_again() -> None:
    flight = StationFlight("px4", "copter")
    flight.run_for(5.0)
    began = len(flight.sent)
    flight.start(flight.goal(flight.far(20.0), by_mission=True))
    flight.run_until(lambda: bool(flight.vehicle.stored_lists.mission), 20.0)
    flight.run_for(5.0)
    lists = [m for _, m in flight.sent[began:] if m.get_type() == "MISSION_REQUEST_LIST"]
    assert len(lists) == 1  # the read-back of the upload
    assert mission(flight)[-1].position_enu_m[:2] == pytest.approx(flight.far(20.0)[:2], abs=1.0)


def reading(flight: SimulatedFlight) -> SimulatedFlight:
    """Wait until a list is being read again."""
    flight.run_for(55.0)
    flight.run_until(
        lambda: flight.sent[-1][1].get_type() in ("MISSION_REQUEST_LIST", "MISSION_REQUEST_INT"),
        10.0,
    )
    return flight


def test_the_end_of_our_reading_is_sent_before_our_upload_begins() -> None:
    """A PX4 takes a later one for the end of the upload (mavlink_mission.cpp)."""
    flight = reading(with_lists("px4"))
    flight.vehicle.missions.upload(flight.vehicle.stored_lists.mission or (), flight.now)
    sent = [message.get_type() for message in flight.vehicle.messages_to_send()]
    assert [name for name in sent if name.startswith("MISSION")] == ["MISSION_ACK", "MISSION_COUNT"]


def test_a_station_that_begins_to_transfer_stops_our_reading() -> None:
    flight = reading(with_lists("px4"))
    message = with_source(make("MISSION_REQUEST_LIST", **TARGET, mission_type=0), 255, 190)
    began = flight.now
    flight.bridge.overhear(message, flight.now)
    flight.run_for(1.5)
    during = [m for at, m in flight.sent if at > began and m.get_type().startswith("MISSION_")]
    assert [m.get_type() for m in during] in ([], ["MISSION_ACK"])
