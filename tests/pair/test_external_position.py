"""Flight without GPS, by a position from outside, with both firmwares."""

from __future__ import annotations

import math
import random

import pytest
from diagnostic_msgs.msg import DiagnosticStatus

from drone_navigation.server.subscribing.external_odometry import external_diagnostic
from mavlink_sitl import DEFAULT_HOME, VehicleConfig
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.positions.frames import quaternion_from_euler
from mavlink_vehicle.protocols.streams.external_position import ExternalPose, ExternalPositionError
from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.goals.requests import LandRequest
from navigation_bridge.requests.external_positions import ExternalPositions
from tests.support.flights.simulated_flight import SimulatedFlight

pytestmark = pytest.mark.wide


ORIGIN = (-35.0, 149.0, 600.0)
SET_ORIGIN = mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN
_PERIOD_S = 0.04


class ExternalFlight(SimulatedFlight):
    """A vehicle without a GPS, and a camera that sees where it is, 25 times a second."""

    def __init__(
        self, autopilot: str, with_velocity: bool, origin: bool = True, firmware: str = ""
    ) -> None:
        text = " ".join(map(str, ORIGIN)) if origin else ""
        super().__init__(
            simulated=VehicleConfig(
                autopilot=autopilot, firmware=firmware, ready_after_s=1.0, external_position=True
            ),
            external_odometry_topic="/camera/odometry",
            external_origin=text,
        )
        self.with_velocity = with_velocity
        self.seeing = True
        self.shift_ned_m = (0.0, 0.0, 0.0)
        self._next_s = 0.0
        self._random = random.Random(4)

    def tick(self) -> None:
        super().tick()
        if self.seeing and self.now >= self._next_s and self.vehicle.heartbeats.alive:
            self._next_s = self.now + _PERIOD_S
            self.bridge.feature(ExternalPositions).send(self.seen(), self.now)

    def seen(self) -> ExternalPose:
        motion = self.simulation.vehicles[0].truth()
        noise = [self._random.gauss(0.0, 0.01) for _ in range(3)]
        north, east, down = (
            p + n + s for p, n, s in zip(motion[:3], noise, self.shift_ned_m, strict=True)
        )
        return ExternalPose(
            self.now - 0.01,
            (north, east, down),
            quaternion_from_euler(*motion[6:9]),
            (motion.speed_m_s, 0.0, 0.0) if self.with_velocity else None,
            pose_variance=(0.01, 0.01, 0.01, 0.001, 0.001, 0.001),
        )

    def names_sent(self) -> list[str]:
        return [message.get_type() for _, message in self.sent]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize("with_velocity", [False, True])
def test_a_goal_is_flown_without_gps(autopilot: str, with_velocity: bool) -> None:
    flight = ExternalFlight(autopilot, with_velocity)
    flight.ready()
    gps = flight.vehicle.state.gps
    assert gps is None or gps.fix_type == 0
    origin = flight.vehicle.state.origin
    assert origin is not None
    assert origin.latitude_deg == pytest.approx(ORIGIN[0], abs=1e-6)
    flight.run_for(2.0)
    end = flight.run_to_end(flight.send(8.0, 5.0, 4.0))
    assert end.code.value == "SUCCESS", end.message
    (east, north, up), _ = flight.truth()
    assert math.dist((east, north, up), (8.0, 5.0, 4.0)) < 1.0
    sent = set(flight.names_sent())
    expected = "ODOMETRY" if with_velocity or autopilot == "px4" else "VISION_POSITION_ESTIMATE"
    assert {"ODOMETRY", "VISION_POSITION_ESTIMATE"} & sent == {expected}


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_source_that_ends_in_flight_ends_the_goal(autopilot: str) -> None:
    flight = ExternalFlight(autopilot, True)
    flight.ready()
    flight.run_for(2.0)
    goal = flight.send(60.0, 0.0, 4.0)
    flight.run_to_status(goal, "NAVIGATING")
    flight.run_for(3.0)
    flight.seeing = False
    end = flight.run_to_end(goal)
    assert end.code.value in ("NO_POSITION", "FAILSAFE_GPS", "VEHICLE_FAILSAFE"), end.message
    warned = [line.text for line in flight.log_lines() if line.level is LogLevel.WARN]
    assert sum("No external pose for 1.0 s" in text for text in warned) == 1
    silent = external_diagnostic(flight.bridge, "server", "system 1", flight.now)
    assert silent is not None
    assert silent.level == DiagnosticStatus.WARN
    flight.seeing = True
    flight.run_for(1.0)
    assert any("External poses again" in line.text for line in flight.log_lines())
    present = external_diagnostic(flight.bridge, "server", "system 1", flight.now)
    assert present is not None
    assert present.level == DiagnosticStatus.OK


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_source_that_jumps_counts_as_reset_and_the_estimate_follows(autopilot: str) -> None:
    flight = ExternalFlight(autopilot, True)
    flight.ready()
    flight.run_for(3.0)
    before = flight.bridge.pose
    flight.shift_ned_m = (6.0, 0.0, 0.0)
    flight.run_for(2.0)
    after = flight.bridge.pose
    assert before is not None
    assert after is not None
    assert after.position_enu_m[1] - before.position_enu_m[1] == pytest.approx(6.0, abs=0.3)
    counters = [m.reset_counter for _, m in flight.sent if m.get_type() == "ODOMETRY"]
    assert sorted(set(counters)) == [0, 1]


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_without_an_origin_there_is_no_position_and_the_origin_is_set_once(autopilot: str) -> None:
    flight = ExternalFlight(autopilot, True, origin=False)
    flight.run_for(15.0)
    assert flight.bridge.pose is None
    assert "SET_GPS_GLOBAL_ORIGIN" not in flight.names_sent()

    flight = ExternalFlight(autopilot, True)
    flight.ready()
    flight.run_for(10.0)
    names = flight.names_sent()
    count = names.count("SET_GPS_GLOBAL_ORIGIN")
    assert 1 <= count <= 4
    flight.run_for(10.0)
    assert flight.names_sent().count("SET_GPS_GLOBAL_ORIGIN") == count


@pytest.mark.parametrize("firmware", ["px4-1.18", "px4-1.17"])
def test_a_px4_takes_its_origin_by_what_its_release_knows(firmware: str) -> None:
    """The command, of which a 1.17 says that it does not know it, or the message."""
    flight = ExternalFlight("px4", True, firmware=firmware).ready()
    origin = flight.vehicle.state.origin
    assert origin is not None
    assert origin.altitude_amsl_m == pytest.approx(ORIGIN[2])
    asked = [m for _, m in flight.sent if getattr(m, "command", 0) == SET_ORIGIN]
    assert {m.get_type() for m in asked} == {"COMMAND_INT"}
    assert len(asked) == flight.names_sent().count("SET_GPS_GLOBAL_ORIGIN")
    flight.run_for(2.0)
    end = flight.run_to_end(flight.send(6.0, 0.0, 4.0))
    assert end.code.value == "SUCCESS", end.message


def test_without_poses_the_vehicle_has_no_position() -> None:
    for autopilot in ("ardupilot", "px4"):
        flight = ExternalFlight(autopilot, True)
        flight.run_for(3.0)
        flight.seeing = False
        flight.run_for(40.0)
        assert not flight.vehicle.state.position_valid
        assert flight.check(flight.request(5.0, 0.0, 5.0)) is not None


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_vehicle_with_a_gps_keeps_its_origin_and_its_position(autopilot: str) -> None:
    flight = SimulatedFlight(
        simulated=VehicleConfig(autopilot=autopilot, ready_after_s=1.0),
        external_odometry_topic="/camera/odometry",
        external_origin=" ".join(map(str, ORIGIN)),
    )
    flight.ready()
    flight.run_for(3.0)
    pose = ExternalPose(flight.now, (50.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
    flight.bridge.feature(ExternalPositions).send(pose, flight.now)
    flight.run_for(2.0)
    assert "SET_GPS_GLOBAL_ORIGIN" not in [message.get_type() for _, message in flight.sent]
    origin, shown = flight.vehicle.state.origin, flight.bridge.pose
    assert origin is not None
    assert origin.latitude_deg == pytest.approx(DEFAULT_HOME.latitude_deg, abs=1e-4)
    assert shown is not None
    assert abs(shown.position_enu_m[1]) < 3.0


def test_a_vehicle_that_is_elsewhere_than_its_poses_say_gets_no_goal() -> None:
    """A PX4 with EKF2_HGT_REF 3 was 100 m below its poses with an origin 100 m above the sea."""
    flight = SimulatedFlight(external_odometry_topic="/camera/odometry")
    flight.ready()
    flight.run_for(2.0)
    request = flight.request(5.0, 0.0, 5.0)
    assert flight.check(request) is None
    level = (1.0, 0.0, 0.0, 0.0)
    flight.bridge.feature(ExternalPositions).send(
        ExternalPose(flight.now, (0.0, 0.0, 100.0), level), flight.now
    )
    rejection = flight.check(request)
    assert rejection is not None
    assert rejection.code.value == "UNHEALTHY"
    assert "100.0 m from that of external_odometry_topic" in rejection.message
    assert flight.check(LandRequest()) is None or "external" not in str(flight.check(LandRequest()))
    flight.run_for(1.5)
    assert flight.check(request) is None


def test_a_pose_without_a_vehicle_is_rejected() -> None:
    flight = SimulatedFlight()
    with pytest.raises(ExternalPositionError, match="no connection"):
        flight.bridge.feature(ExternalPositions).send(
            ExternalPose(0.0, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)), 0.0
        )
