"""Circles, on each kind of vehicle and both firmwares: how well they are kept, what is rejected."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from mavlink_sitl import Obstacle, RangeSensor, VehicleConfig, Wind, World
from navigation_bridge.goals.requests import OrbitRequest
from navigation_core.outcomes import OutcomeCode
from tests.support.flights.simulated_flight import SimulatedFlight

CENTRE = (20.0, 10.0, 0.0)
ORBIT = OrbitRequest("map", CENTRE, 8.0, 6.0, 1.0, 3.0)
WIND_M_S = 8.0


def kind_of(vehicle: str, autopilot: str = "ardupilot") -> VehicleConfig:
    return VehicleConfig(ready_after_s=1.0, vehicle=vehicle, autopilot=autopilot)


@dataclass
class Watched:
    """A flown circle.

    Attributes:
        errors_m: true distance to the centre minus the radius, ten times a second.
        turned_rad: how far it went round near the circle, anticlockwise.
        off_rad: true angle between its yaw and the direction to the centre.
    """

    errors_m: list[float] = field(default_factory=list)
    turned_rad: float = 0.0
    off_rad: list[float] = field(default_factory=list)


def watch(
    flight: SimulatedFlight, goal_id: str, request: OrbitRequest, timeout_s: float = 400.0
) -> Watched:
    """Continue to a goal's end, and look where the vehicle truly is while it goes round."""
    watched, before, end_s = Watched(), None, flight.now + timeout_s
    while not flight.ends(goal_id):
        assert flight.now < end_s, flight.outputs[-3:]
        flight.run_for(0.1)
        feedback = flight.feedback(goal_id)
        orbit = feedback[-1].orbit if feedback else None
        pose = flight.bridge.pose
        if orbit is None or pose is None or math.isnan(orbit.radius_error_m):
            continue
        (east, north, _), _ = flight.truth()
        angle = math.atan2(north - request.centre[1], east - request.centre[0])
        away_m = math.hypot(north - request.centre[1], east - request.centre[0])
        watched.errors_m.append(away_m - abs(request.radius_m))
        watched.off_rad.append(abs(math.remainder(pose.yaw_enu_rad - angle - math.pi, math.tau)))
        on_circle = abs(watched.errors_m[-1]) < 0.35 * abs(request.radius_m)
        if before is not None and on_circle:
            watched.turned_rad += math.remainder(angle - before, math.tau)
        before = angle
    return watched


@pytest.mark.night_but_first
@pytest.mark.wide
@pytest.mark.parametrize(
    ("vehicle", "autopilot", "share"),
    [
        ("copter", "ardupilot", 0.05),
        pytest.param("copter", "px4", 0.05, marks=pytest.mark.wide),
        pytest.param("rover", "ardupilot", 0.05, marks=pytest.mark.wide),
        pytest.param("rover", "px4", 0.05, marks=pytest.mark.wide),
        # A boat drifts outwards, until that is known.
        pytest.param("boat", "ardupilot", 0.25, marks=pytest.mark.wide),
        pytest.param("boat", "px4", 0.25, marks=pytest.mark.wide),
    ],
)
def test_it_goes_round_on_the_circle_in_its_direction(
    vehicle: str, autopilot: str, share: float
) -> None:
    flight = SimulatedFlight(simulated=kind_of(vehicle, autopilot)).ready()
    height_m = 6.0 if vehicle == "copter" else math.nan
    request = replace(ORBIT, radius_m=-10.0, height_m=height_m, laps=1.25)
    goal_id = flight.start(request)
    watched = watch(flight, goal_id, request)
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert end.laps_flown == 1.25
    assert watched.turned_rad == pytest.approx(-1.25 * math.tau, abs=0.5)
    assert np.percentile(np.abs(watched.errors_m), 95) < share * 10.0
    assert np.median(np.abs(watched.errors_m)) < 0.05 * 10.0
    if vehicle == "copter":
        assert flight.truth()[0][2] == pytest.approx(6.0, abs=0.5)
        assert max(watched.off_rad) < math.radians(25.0)
    laps = [each.orbit.laps_flown for each in flight.feedback(goal_id) if each.orbit]
    assert laps == sorted(laps)


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_in_a_strong_wind_it_keeps_to_the_circle(autopilot: str) -> None:
    """At 5 m/s in 8 m/s of wind, which is more than a simulated PX4 can fly against.

    It then goes as fast as it can: the setpoint waits for it, and not beside the circle.
    """
    world = World(wind=Wind((0.0, WIND_M_S, 0.0)))
    flight = SimulatedFlight(simulated=kind_of("copter", autopilot), world=world, speed_max_m_s=6.0)
    request = replace(ORBIT, radius_m=30.0, height_m=10.0, laps=1.0, max_speed_m_s=5.0)
    goal_id = flight.ready().start(request)
    errors_m = np.abs(watch(flight, goal_id, request).errors_m)
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    shares = 100.0 * np.array([np.median(errors_m), np.percentile(errors_m, 95), errors_m.max()])
    print(f"{autopilot}: radius error {shares / 30.0} % (median, p95, max) of 30 m")
    assert np.percentile(errors_m, 95) < 0.03 * 30.0


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize(("autopilot", "share"), [("ardupilot", 0.1), ("px4", 0.03)])
def test_a_plane_goes_round_on_its_own_circle(autopilot: str, share: float) -> None:
    """The circle of 80 m to the right that both firmwares have by default."""
    flight = SimulatedFlight(simulated=kind_of("plane", autopilot)).ready()
    request = replace(ORBIT, centre=(200.0, 100.0, 0.0), radius_m=-80.0, height_m=80.0, laps=1.5)
    goal_id = flight.start(replace(request, max_speed_m_s=0.0))
    watched = watch(flight, goal_id, request)
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert end.laps_flown == 1.5
    assert watched.turned_rad == pytest.approx(-1.5 * math.tau, abs=0.3)
    assert np.percentile(np.abs(watched.errors_m), 95) < share * 80.0
    assert not flight.simulation.truth.on_ground[0]


@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("radius_m", [150.0, -130.0])
def test_a_plane_goes_round_with_another_radius_and_direction_then_with_its_usual_one(
    autopilot: str, radius_m: float
) -> None:
    flight = SimulatedFlight(simulated=kind_of("plane", autopilot)).ready()
    centre = (100.0, 50.0, 0.0)
    request = replace(ORBIT, centre=centre, radius_m=radius_m, height_m=80.0, laps=1.2)
    goal_id = flight.start(replace(request, max_speed_m_s=0.0))
    watched = watch(flight, goal_id, request)
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert watched.turned_rad == pytest.approx(math.copysign(1.2 * math.tau, radius_m), abs=0.3)
    # It begins inside of the larger circle, and not in its direction.
    errors_m = np.abs(watched.errors_m[len(watched.errors_m) // 2 :])
    assert np.percentile(errors_m, 95) < 0.1 * abs(radius_m)
    flight.run_to_end(flight.send(100.0, 51.0, 80.0))
    flight.run_for(60.0)
    east_m, north_m = flight.truth()[0][:2]
    assert math.hypot(east_m - 100.0, north_m - 51.0) == pytest.approx(80.0, rel=0.1)


def test_a_circle_that_a_plane_cannot_keep_is_rejected() -> None:
    flight = SimulatedFlight(simulated=kind_of("plane")).ready()
    for radius_m, speed_m_s in ((40.0, 0.0), (-40.0, 0.0), (60.0, 30.0)):
        request = replace(ORBIT, radius_m=radius_m, height_m=80.0, max_speed_m_s=speed_m_s)
        rejection = flight.check(request)
        assert rejection is not None
        assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
        assert "turning circle at its airspeed" in rejection.message
    low = flight.check(replace(ORBIT, radius_m=-80.0, height_m=10.0))
    assert low is not None
    assert low.code is OutcomeCode.UNSUPPORTED_VEHICLE


def test_a_speed_that_the_circle_does_not_allow_is_reduced_and_said_so() -> None:
    flight = SimulatedFlight(speed_max_m_s=10.0).ready()
    request = replace(ORBIT, radius_m=4.0, laps=0.5, max_speed_m_s=8.0)
    goal_id = flight.start(request)
    fastest_m_s = 0.0
    while not flight.ends(goal_id):
        flight.run_for(0.1)
        fastest_m_s = max(fastest_m_s, flight.truth()[1])
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS
    assert "The speed is 2.5 m/s instead of 8 m/s" in end.message
    assert fastest_m_s < 2.5 + 1.0


@pytest.mark.night
@pytest.mark.wide
@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_it_is_paused_resumed_and_cancelled_like_any_flight(autopilot: str) -> None:
    flight = SimulatedFlight(simulated=kind_of("copter", autopilot)).ready()
    goal_id = flight.start(replace(ORBIT, laps=0.0))

    def flown() -> float:
        orbit = flight.feedback(goal_id)[-1].orbit if flight.feedback(goal_id) else None
        return 0.0 if orbit is None else orbit.laps_flown

    flight.run_until(lambda: flown() > 0.6)
    assert flight.bridge.services.pause(flight.now)[0]
    flight.run_for(8.0)
    assert flight.status(goal_id) == "PAUSED"
    assert flight.truth()[1] < 0.5
    before = flown()
    assert flight.bridge.services.resume(flight.now)[0]
    flight.run_until(lambda: flown() > 2.2)
    assert before < 1.0
    assert flight.bridge.goals.cancel(goal_id, flight.now)
    end = flight.run_to_end(goal_id)
    assert end.code is OutcomeCode.CANCELED
    assert end.laps_flown > 2.2
    assert flight.truth()[1] < 0.5


def test_a_pilot_who_takes_over_has_the_vehicle() -> None:
    flight = SimulatedFlight().ready()
    goal_id = flight.start(replace(ORBIT, laps=0.0))
    flight.run_until(lambda: len(flight.feedback(goal_id)) > 0 and _goes_round(flight, goal_id))
    flight.set_mode_as_pilot("LOITER")
    end = flight.run_to_end(goal_id)
    assert end.code is OutcomeCode.PILOT_OVERRIDE


def _goes_round(flight: SimulatedFlight, goal_id: str) -> bool:
    orbit = flight.feedback(goal_id)[-1].orbit
    return orbit is not None and orbit.laps_flown > 0.1


@pytest.mark.wide
@pytest.mark.parametrize("vehicle", ["copter", pytest.param("rover", marks=pytest.mark.night)])
def test_an_obstacle_that_only_the_sensor_knows_is_passed_and_the_circle_continued(
    vehicle: str,
) -> None:
    post = Obstacle("post", (CENTRE[1], CENTRE[0] + 8.0), radius_m=0.4, top_m=20.0)
    world = World(obstacles=(post,), range_sensor=RangeSensor(reach_m=15.0, noise_m=0.02))
    flight = SimulatedFlight(simulated=kind_of(vehicle), world=world).ready()
    flight.run_for(1.0)
    height_m = 4.0 if vehicle == "copter" else math.nan
    request = replace(ORBIT, laps=1.25, height_m=height_m, max_speed_m_s=2.0, avoid_obstacles=True)
    goal_id = flight.start(request)
    watch(flight, goal_id, request)
    (end,) = flight.ends(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    assert end.laps_flown == 1.25
    assert not flight.ground_truth.collided
    assert not flight.ground_truth.hits


# --- what is rejected --------------------------------------------------------------------

Change = Callable[[OrbitRequest], OrbitRequest]
REJECTED: dict[str, tuple[Change, str, str]] = {
    "radius 0": (lambda r: replace(r, radius_m=0.0), "INVALID_NUMBER", "radius is 0 m"),
    "radius NaN": (lambda r: replace(r, radius_m=math.nan), "INVALID_NUMBER", "radius is nan"),
    "radius infinite": (lambda r: replace(r, radius_m=-math.inf), "INVALID_NUMBER", "radius"),
    "radius tiny": (lambda r: replace(r, radius_m=-0.2), "INVALID_NUMBER", "at least 1 m"),
    "laps negative": (lambda r: replace(r, laps=-1.0), "INVALID_NUMBER", "laps is -1"),
    "laps NaN": (lambda r: replace(r, laps=math.nan), "INVALID_NUMBER", "laps is nan"),
    "laps many": (lambda r: replace(r, laps=2000.0), "INVALID_NUMBER", "laps is 2000"),
    "centre NaN": (
        lambda r: replace(r, centre=(math.nan, 0.0, 0.0)),
        "INVALID_NUMBER",
        "centre.pose.position.x is nan",
    ),
    "height infinite": (lambda r: replace(r, height_m=math.inf), "INVALID_NUMBER", "height"),
    "below ground": (lambda r: replace(r, height_m=-3.0), "BELOW_GROUND", "below the ground"),
    "above ceiling": (lambda r: replace(r, height_m=1e4), "OUTSIDE_VOLUME", "On the circle"),
    "outside": (lambda r: replace(r, radius_m=5e4), "OUTSIDE_VOLUME", "On the circle"),
    "frame": (lambda r: replace(r, frame_id="odometry"), "UNKNOWN_FRAME", "'odometry'"),
    "not on earth": (
        lambda r: replace(r, frame_id="wgs84", centre=(91.0, 0.0, 0.0)),
        "INVALID_NUMBER",
        "not a position on earth",
    ),
    "speed negative": (lambda r: replace(r, max_speed_m_s=-1.0), "NEGATIVE_SPEED", "max_speed"),
    "yaw": (lambda r: replace(r, yaw=None), "INVALID_NUMBER", "yaw_mode"),
}


@pytest.fixture(scope="module")
def standing() -> SimulatedFlight:
    return SimulatedFlight().ready()


@pytest.mark.parametrize("case", REJECTED)
def test_what_cannot_be_flown_is_rejected_with_a_code_and_a_sentence(
    standing: SimulatedFlight, case: str
) -> None:
    change, code, words = REJECTED[case]
    rejection = standing.check(change(ORBIT))
    assert rejection is not None
    assert rejection.code.value == code
    assert words in rejection.message
    assert standing.setpoint_times(0.0) == []


def test_a_circle_within_the_turning_circle_of_what_drives_is_rejected() -> None:
    flight = SimulatedFlight(simulated=kind_of("boat")).ready()
    rejection = flight.check(replace(ORBIT, radius_m=1.0, height_m=math.nan))
    assert rejection is not None
    assert rejection.code is OutcomeCode.UNSUPPORTED_VEHICLE
    assert "turning circle" in rejection.message
    climbing = flight.check(replace(ORBIT, height_m=6.0))
    assert climbing is not None
    assert climbing.code is OutcomeCode.UNSUPPORTED_VEHICLE


def test_a_known_obstacle_may_stand_in_the_centre_but_not_on_the_circle(tmp_path: Path) -> None:
    path = tmp_path / "obstacles.yaml"
    path.write_text(
        "obstacles: [{kind: cylinder, name: mast, at_m: [20, 10], radius_m: 2, height_m: 30}]"
    )
    flight = SimulatedFlight(obstacles_file=str(path)).ready()
    assert flight.check(replace(ORBIT, avoid_obstacles=True)) is None
    for avoid in (True, False):
        on_it = replace(ORBIT, centre=(12.0, 10.0, 0.0), avoid_obstacles=avoid)
        rejection = flight.check(on_it)
        assert rejection is not None
        assert rejection.code is OutcomeCode.NO_PATH
        assert "'mast' at (20.0, 10.0) m" in rejection.message


def test_a_circle_beyond_the_fence_is_rejected() -> None:
    fenced = replace(
        kind_of("copter"), parameters={"FENCE_ENABLE": 1.0, "FENCE_TYPE": 2.0, "FENCE_RADIUS": 30.0}
    )
    flight = SimulatedFlight(simulated=fenced).ready()
    flight.run_for(2.0)
    rejection = flight.check(replace(ORBIT, radius_m=12.0))
    assert rejection is not None
    assert rejection.code is OutcomeCode.OUTSIDE_FENCE


@pytest.mark.parametrize("frame", ["base_link", "wgs84"])
def test_the_centre_may_be_given_in_each_frame(frame: str) -> None:
    flight, home = SimulatedFlight().ready(), VehicleConfig().home
    centre = (
        (0.0, 0.0, 0.0) if frame == "base_link" else (home.latitude_deg, home.longitude_deg, 0.0)
    )
    goal_id = flight.start(replace(ORBIT, frame_id=frame, centre=centre, laps=0.1))
    end = flight.run_to_end(goal_id)
    assert end.code is OutcomeCode.SUCCESS, end.message
    (east, north, _), _ = flight.truth()
    assert math.hypot(east, north) == pytest.approx(8.0, abs=0.6)
