"""A goal that is rehearsed goes as it is then flown: the same code, only faster."""

from __future__ import annotations

import math
import random
import statistics
from dataclasses import replace

import pytest

from flight_rehearsal.flight_parameters import KINDS, SERVER_PARAMETERS, VEHICLE_PARAMETERS
from flight_rehearsal.rehearsal import StoppedError, lose_link, rehearse
from flight_rehearsal.rehearsed_flight import RehearsedFlight
from flight_rehearsal.request import (
    HomePoint,
    RehearsalRequest,
    RehearsalStep,
    RehearsalWaypoint,
    RequestError,
)
from mavlink_sitl import BatteryModel, VehicleConfig
from navigation_bridge.configuration.parameter_table import SERVER_WIDE, SPECS
from navigation_core.geometry import Vector3, distance
from navigation_core.safety.energy import ConsumptionEstimator
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


GOALS = 7
ERROR_MAX = 0.05
SERVER = {"arming": "auto", "battery_policy": "ignore"}
COPTER = RehearsalRequest(
    "ArduCopter",
    (RehearsalWaypoint((20.0, 10.0, 6.0)),),
    position_enu_m=(0.0, 0.0, 5.0),
    armed=True,
    flying=True,
    battery=0.8,
    server=SERVER,
)
ROUTE = (
    RehearsalWaypoint((10.0, 0.0, 5.0)),
    RehearsalWaypoint((10.0, 10.0, 8.0), 2.0),
    RehearsalWaypoint((0.0, 10.0, 5.0)),
)
POST = (10.0, 0.0, 1.0, 0.0, 20.0)


def order_of(
    flight: SimulatedFlight, name: str, goal: Vector3, speed_m_s: float
) -> RehearsalRequest:
    """Return what a console would know of a flight at this moment."""
    pose, state = flight.bridge.pose, flight.vehicle.state
    assert pose is not None
    assert state.local_position is not None
    assert state.battery is not None
    assert state.home is not None
    home_at = flight.bridge.map_frame.home_enu_m(flight.bridge.vehicle.state)
    assert home_at is not None
    north, east, down = state.local_position.velocity_ned_m_s
    home = state.home
    return RehearsalRequest(
        name,
        (RehearsalWaypoint(goal),),
        position_enu_m=pose.position_enu_m,
        yaw_enu_rad=pose.yaw_enu_rad,
        velocity_enu_m_s=(east, north, -down),
        armed=state.armed,
        flying=pose.position_enu_m[2] > 0.5,
        battery=state.battery.remaining or 1.0,
        home=HomePoint(home.latitude_deg, home.longitude_deg, home.altitude_amsl_m, home_at),
        speed_m_s=speed_m_s,
        server=SERVER,
    )


@pytest.mark.night_but_first
@pytest.mark.parametrize(
    ("name", "vehicle"),
    [
        ("ArduCopter", VehicleConfig(ready_after_s=1.0)),
        ("PX4 multicopter", VehicleConfig(autopilot="px4", ready_after_s=1.0)),
        ("ArduRover", VehicleConfig(vehicle="rover", ready_after_s=1.0)),
    ],
    ids=["ardupilot", "px4", "rover"],
)
def test_a_goal_takes_as_long_as_it_was_rehearsed(name: str, vehicle: VehicleConfig) -> None:
    """The first goal of a copter begins on the ground."""
    flight = SimulatedFlight(simulated=vehicle, battery_policy="ignore").ready()
    rng = random.Random(5)
    errors = []
    for _ in range(GOALS):
        up = 0.0 if name == "ArduRover" else rng.uniform(3.0, 20.0)
        goal = (rng.uniform(-40.0, 40.0), rng.uniform(-40.0, 40.0), up)
        speed_m_s = rng.choice((0.0, 2.0, 5.0))
        rehearsed = rehearse(order_of(flight, name, goal, speed_m_s))
        assert rehearsed.code == "SUCCESS", rehearsed.text
        goal_id, began_s = flight.send(*goal, speed_m_s), flight.now
        flight.run_until(lambda goal_id=goal_id: bool(flight.ends(goal_id)))  # type: ignore[misc]
        flown_s = flight.now - began_s
        errors.append(abs(rehearsed.duration_s - flown_s) / flown_s)
        assert distance(rehearsed.path_enu_m[-1], flight.truth()[0]) < 1.0
    assert statistics.median(errors) < ERROR_MAX, errors
    assert max(errors) < 4.0 * ERROR_MAX, errors


def flown_battery(flight: SimulatedFlight) -> float:
    battery = flight.vehicle.state.battery
    assert battery is not None
    assert battery.remaining is not None
    return battery.remaining


@pytest.mark.night
@pytest.mark.parametrize(
    ("autopilot", "kind", "parameters"),
    [
        ("ardupilot", "ArduCopter", {}),
        ("px4", "PX4 multicopter", {"SIM_BAT_DRAIN": 600.0, "SIM_BAT_MIN_PCT": 0.0}),
    ],
)
def test_the_battery_at_the_end_is_by_the_consumption_that_was_flown(
    autopilot: str, kind: str, parameters: dict[str, float]
) -> None:
    pack = BatteryModel(capacity_mah=3000.0)
    vehicle = VehicleConfig(
        ready_after_s=1.0, autopilot=autopilot, battery=pack, parameters=parameters
    )
    flight = SimulatedFlight(simulated=vehicle, battery_policy="ignore").ready()
    flight.fly_up()
    measured = ConsumptionEstimator(endurance_s=math.inf)
    for _ in range(150):
        flight.run_for(1.0)
        measured.observe(flight.now, flown_battery(flight), under_way=True)
    order = order_of(flight, kind, (60.0, 0.0, 10.0), 0.0)
    assert rehearse(replace(order, parameters={})).battery is None
    rehearsed = rehearse(
        replace(order, parameters={}, consumption_per_s=measured.measured_rate_per_s)
    )
    flight.run_to_end(flight.send(60.0, 0.0, 10.0))
    assert order.battery is not None
    assert order.battery - flown_battery(flight) > 0.02
    assert rehearsed.battery == pytest.approx(flown_battery(flight), abs=0.015)


def test_the_battery_of_a_simulated_px4_is_by_its_own_parameter() -> None:
    parameters = {"SIM_BAT_DRAIN": 60.0, "SIM_BAT_MIN_PCT": 0.0}
    order = replace(COPTER, autopilot="PX4 multicopter", battery=1.0, parameters=parameters)
    rehearsed = rehearse(order)
    assert rehearsed.battery == pytest.approx(1.0 - rehearsed.duration_s / 60.0, abs=0.02)
    assert rehearse(replace(order, battery=None)).battery is None


@pytest.mark.parametrize("name", [name for name in KINDS if "boat" not in name])
def test_a_route_with_a_hold_is_rehearsed(name: str) -> None:
    up = 0.0 if "over" in name else 5.0
    route = tuple(
        replace(w, position_enu_m=(*w.position_enu_m[:2], w.position_enu_m[2] if up else 0.0))
        for w in ROUTE
    )
    order = replace(COPTER, autopilot=name, waypoints=route, position_enu_m=(0.0, 0.0, up))
    flown = rehearse(order)
    assert flown.code == "SUCCESS", flown.text
    assert distance(flown.path_enu_m[-1], route[-1].position_enu_m) < 1.0
    again = rehearse(replace(order, laps=2))
    assert again.duration_s > 1.5 * flown.duration_s


def test_a_circle_is_rehearsed() -> None:
    flown = rehearse(replace(COPTER, radius_m=-8.0))
    assert flown.code == "SUCCESS", flown.text
    centre = COPTER.waypoints[0].position_enu_m
    radii_m = [math.dist(point[:2], centre[:2]) for point in flown.path_enu_m[-80:]]
    assert statistics.median(radii_m) == pytest.approx(8.0, abs=0.3)
    (x, y, _), (last_x, last_y, _) = flown.path_enu_m[-30], flown.path_enu_m[-20]
    assert (x - centre[0]) * (last_y - centre[1]) < (y - centre[1]) * (last_x - centre[0])
    assert flown.path_enu_m[-1][2] == pytest.approx(centre[2], abs=0.5)
    again = rehearse(replace(COPTER, radius_m=0.5))
    assert not again.accepted
    assert again.code == "INVALID_NUMBER"


def test_obstacles_are_flown_round_only_where_that_is_asked_for() -> None:
    past = replace(
        COPTER,
        waypoints=(RehearsalWaypoint((20.0, 0.0, 5.0)),),
        posts=(POST,),
        post_names=("mast",),
    )
    through = rehearse(past)
    hit = through.approach
    assert hit is not None
    assert (hit.clearance_m, hit.is_too_near, hit.obstacle) == (0.0, True, "'mast'")
    # The post begins at 9 m, and the hull is half a metre.
    assert hit.position_enu_m == pytest.approx((8.5, 0.0, 5.0), abs=0.3)
    assert hit.along_m == pytest.approx(8.5, abs=0.4)
    round_it = rehearse(replace(past, avoid_obstacles=True))
    assert round_it.code == "SUCCESS", round_it.text
    assert round_it.approach is not None
    assert round_it.approach.clearance_m > 0.5
    assert not round_it.approach.is_too_near
    assert round_it.duration_s > through.duration_s
    box = (10.0, 0.0, 1.0, 1.0, 0.3, 0.0, 20.0)
    boxed = rehearse(replace(past, posts=(), boxes=(box,), avoid_obstacles=True))
    assert boxed.approach is not None
    assert boxed.approach.clearance_m > 0.5
    assert rehearse(COPTER).approach is None


def test_a_path_that_passes_nearer_than_the_margin_is_too_near() -> None:
    beside = replace(COPTER, waypoints=(RehearsalWaypoint((20.0, 0.0, 5.0)),))
    near = rehearse(replace(beside, posts=((10.0, 2.0, 1.0, 0.0, 20.0),))).approach
    assert near is not None
    assert near.is_too_near
    assert near.clearance_m == pytest.approx(0.5, abs=0.2)
    assert near.along_m == pytest.approx(10.0, abs=0.5)
    far = rehearse(replace(beside, posts=((10.0, 3.0, 1.0, 0.0, 20.0),))).approach
    assert far is not None
    assert not far.is_too_near


def test_what_is_only_sensed_rejects_no_target_as_in_the_server() -> None:
    """Such a goal is accepted, and then blocked."""
    inside = replace(COPTER, waypoints=(RehearsalWaypoint((10.0, 0.0, 5.0)),), avoid_obstacles=True)
    known = rehearse(replace(inside, posts=(POST,), post_names=("mast",)))
    assert (known.accepted, known.code) == (False, "NO_PATH")
    assert "the known obstacle 'mast'" in known.text
    sensed = rehearse(replace(inside, sensed=(POST,)))
    assert (sensed.accepted, sensed.code) == (True, "NO_PATH")
    straight = rehearse(replace(inside, sensed=(POST,), avoid_obstacles=False)).approach
    assert straight is not None
    assert (straight.obstacle, straight.clearance_m) == ("a sensed obstacle", 0.0)


def test_a_return_after_a_lost_link_may_hit_as_well() -> None:
    far = (RehearsalWaypoint((80.0, 0.0, 5.0)),)
    beside = replace(
        COPTER, waypoints=far, position_enu_m=(30.0, 0.0, 5.0), autopilot="PX4 multicopter",
        posts=((10.0, 0.0, 2.0, 0.0, 60.0),),
    )  # fmt: skip
    flown = rehearse(beside)
    assert flown.approach is not None
    assert not flown.approach.is_too_near
    lost = lose_link(beside, 0.5 * flown.duration_s)
    assert lost.approach is not None
    assert lost.approach.clearance_m == 0.0


def test_a_goal_from_the_ground_takes_off_and_one_that_may_not_is_rejected() -> None:
    on_ground = replace(COPTER, position_enu_m=(4.0, 3.0, 0.0), armed=False, flying=False)
    flown = rehearse(on_ground)
    assert flown.code == "SUCCESS", flown.text
    assert flown.path_enu_m[0] == pytest.approx((4.0, 3.0, 0.0), abs=0.1)
    refused = rehearse(replace(on_ground, server={"arming": "never"}))
    assert not refused.accepted
    assert refused.code == "ARMING_NOT_ALLOWED"
    assert refused.text.endswith(".")
    far = rehearse(replace(COPTER, waypoints=(RehearsalWaypoint((9000.0, 0.0, 5.0)),)))
    assert not far.accepted


def test_wind_and_the_charge_decide_the_flight() -> None:
    calm = rehearse(COPTER)
    blown = rehearse(replace(COPTER, wind_enu_m_s=(-9.0, 0.0, 0.0)))
    assert blown.duration_s > calm.duration_s
    assert blown.battery is None  # nothing was measured
    empty = rehearse(replace(COPTER, battery=0.05, server={"arming": "auto"}))
    assert empty.code == "LOW_BATTERY"


@pytest.mark.parametrize(
    ("name", "parameters", "mode", "landed_at"),
    [
        ("ArduCopter", {"FS_GCS_ENABLE": 0.0}, "GUIDED", None),
        ("ArduCopter", {"FS_GCS_ENABLE": 1.0}, "RTL", (0.0, 0.0, 0.0)),
        ("PX4 multicopter", {}, "AUTO.RTL", (0.0, 0.0, 0.0)),
    ],
)
def test_a_lost_link_ends_as_the_failsafe_says(
    name: str, parameters: dict[str, float], mode: str, landed_at: Vector3 | None
) -> None:
    far = (RehearsalWaypoint((80.0, 0.0, 5.0)),)
    order = replace(COPTER, autopilot=name, parameters=parameters, waypoints=far)
    lost = lose_link(order, 0.5 * rehearse(order).duration_s)
    assert lost.mode == mode
    assert lost.landed == (landed_at is not None)
    if landed_at is not None:
        assert distance(lost.position_enu_m, landed_at) < 1.0
    else:
        assert 40.0 < lost.position_enu_m[0] < 60.0
    assert 30.0 < lost.path_enu_m[0][0] < 50.0


def test_it_begins_as_the_vehicle_moves_and_where_the_map_lies() -> None:
    home = HomePoint(47.4, 8.5, 488.0, (3.0, -2.0, -0.5))
    order = replace(COPTER, home=home, velocity_enu_m_s=(2.0, 0.0, 0.0), yaw_enu_rad=1.0)
    stage = RehearsedFlight(order)
    pose = stage.bridge.pose
    assert pose is not None
    assert pose.yaw_enu_rad == pytest.approx(1.0, abs=0.1)
    assert stage.bridge.map_frame.home_enu_m(stage.bridge.vehicle.state) == pytest.approx(
        (3.0, -2.0, -0.5), abs=0.05
    )
    assert pose.position_enu_m == pytest.approx(order.position_enu_m, abs=3.0)
    assert pose.position_enu_m[0] > 0.5


def test_what_cannot_be_rehearsed_is_said() -> None:
    with pytest.raises(RequestError, match="no rehearsal for ArduPlane"):
        rehearse(replace(COPTER, autopilot="ArduPlane"))
    with pytest.raises(RequestError, match="speed_max_m_s"):
        rehearse(replace(COPTER, server={"speed_max_m_s": -1.0}))
    with pytest.raises(RequestError, match="NO_SUCH"):
        rehearse(replace(COPTER, parameters={"NO_SUCH": 1.0}))
    with pytest.raises(StoppedError):
        rehearse(COPTER, lambda: True)


def test_the_parameters_that_are_asked_for_exist() -> None:
    assert {"arming", "speed_max_m_s"} < set(SERVER_PARAMETERS) < SPECS.keys() - SERVER_WIDE
    assert VEHICLE_PARAMETERS.keys() == KINDS.keys()
    for name, (kind, autopilot) in KINDS.items():
        known = {spec.name for spec in VehicleConfig(kind, autopilot).personality().parameters}
        unknown = [each for each in VEHICLE_PARAMETERS[name] if each not in known]
        assert not unknown, f"{name}: {unknown}"
    assert not math.isnan(rehearse(COPTER).duration_s)


STEPS = (
    RehearsalStep("takeoff", height_m=5.0),
    RehearsalStep("go", ((10.0, 0.0, 5.0),), speed_m_s=4.0),
    RehearsalStep("orbit", ((10.0, 10.0, 0.0),), height_m=5.0, radius_m=5.0, laps=0.5),
    RehearsalStep("wait", seconds=3.0),
    RehearsalStep("route", ((0.0, 10.0, 5.0), (0.0, 0.0, 5.0))),
    RehearsalStep("land"),
)
ON_GROUND = replace(COPTER, position_enu_m=(0.0, 0.0, 0.0), armed=False, flying=False)


@pytest.mark.parametrize("name", ["ArduCopter", "PX4 multicopter"])
def test_a_plan_is_rehearsed_step_by_step(name: str) -> None:
    flown = rehearse(replace(ON_GROUND, autopilot=name, waypoints=(), steps=STEPS))
    assert (flown.code, flown.step, flown.accepted) == ("SUCCESS", 0, True), flown.text
    assert distance(flown.path_enu_m[-1], (0.0, 0.0, 0.0)) < 1.0
    for place in ((10.0, 0.0, 5.0), (0.0, 10.0, 5.0)):
        assert min(distance(place, point) for point in flown.path_enu_m) < 1.0
    alone = rehearse(replace(ON_GROUND, autopilot=name, waypoints=(), steps=STEPS[:2]))
    assert alone.duration_s + 3.0 < flown.duration_s


@pytest.mark.parametrize(
    ("at", "step", "code"),
    [
        (0, RehearsalStep("land"), "NOT_FLYING"),
        (1, RehearsalStep("go", ((10.0, 0.0, -5.0),)), "BELOW_GROUND"),
        (3, RehearsalStep("go", ((5000.0, 0.0, 5.0),)), "OUTSIDE_VOLUME"),
    ],
)
def test_a_plan_that_would_be_rejected_says_at_which_step(
    at: int, step: RehearsalStep, code: str
) -> None:
    steps = (*STEPS[:at], step, *STEPS[at:])
    server = {**SERVER, "volume_radius_m": 1000.0}
    flown = rehearse(replace(ON_GROUND, waypoints=(), steps=steps, server=server))
    assert (flown.code, flown.step, flown.accepted) == (code, at + 1, False), flown.text
