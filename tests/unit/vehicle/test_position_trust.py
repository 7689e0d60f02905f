"""Detection of reported positions that cannot be trusted."""

from __future__ import annotations

import math

import pytest

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.state.position_trust import PositionTrust
from mavlink_vehicle.state.reducer import VehicleState, reduce
from tests.support.messages.autopilot_messages import AutopilotMessages

PX4 = mavlink.MAV_AUTOPILOT_PX4
ARDUPILOT = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
LATITUDE_DEG, LONGITUDE_DEG = 47.3977, 8.5456
METRE_N_DEG = 1.0 / 111_195.0
METRE_E_DEG = METRE_N_DEG / math.cos(math.radians(LATITUDE_DEG))


class Watched:
    """A vehicle that flies, and who watches its position."""

    def __init__(self, autopilot: int = ARDUPILOT, armed: bool = True) -> None:
        self.say = AutopilotMessages()
        self.trust = PositionTrust()
        self.now = 100.0
        self.state = VehicleState()
        self.take(self.say.heartbeat(armed=armed, status=4, autopilot=autopilot))
        self.take(self.say("EXTENDED_SYS_STATE", landed_state=mavlink.MAV_LANDED_STATE_IN_AIR))

    def take(self, message: Message) -> None:
        before = self.state
        self.state = reduce(before, message, self.now)
        self.trust.observe(before, self.state, self.now)

    def at(self, north_m: float, east_m: float = 0.0, velocity_m_s: float = 0.0,
           later_s: float = 0.05, clock_step_s: float = 0.001) -> None:  # fmt: skip
        self.now += later_s
        self.take(
            self.say(
                "GLOBAL_POSITION_INT",
                time_boot_ms=round(1e3 * clock_step_s * (self.now // clock_step_s)),
                lat=round((LATITUDE_DEG + north_m * METRE_N_DEG) * 1e7),
                lon=round((LONGITUDE_DEG + east_m * METRE_E_DEG) * 1e7),
                vx=round(100 * velocity_m_s),
            )
        )

    def gps(self, north_m: float, later_s: float = 0.5, fix_type: int = 3) -> None:
        self.now += later_s
        self.take(
            self.say(
                "GPS_RAW_INT",
                fix_type=fix_type,
                lat=round((LATITUDE_DEG + north_m * METRE_N_DEG) * 1e7),
                lon=round(LONGITUDE_DEG * 1e7),
                eph=100,
                h_acc=900,
            )
        )

    def ekf(self, flags: int = 0x33F, ratio: float = 0.01, later_s: float = 1.0) -> None:
        self.now += later_s
        self.take(self.say("EKF_STATUS_REPORT", flags=flags, pos_horiz_variance=ratio))


# --- jumps -----------------------------------------------------------------------------


def test_a_clock_that_counts_whole_seconds_makes_no_jumps() -> None:
    watched = Watched()
    for step in range(100):
        watched.at(0.5 * step, velocity_m_s=5.0, later_s=0.1, clock_step_s=1.0)
    assert watched.trust.jumped_s is None
    watched.at(70.0, velocity_m_s=5.0, later_s=0.1, clock_step_s=0.01)
    assert watched.trust.jump_m() > 10.0


@pytest.mark.parametrize("speed_m_s", [0.0, 5.0, 25.0])
@pytest.mark.parametrize("every_s", [0.05, 0.2, 1.0])
def test_a_flight_at_the_velocity_that_is_reported_is_no_jump(
    speed_m_s: float, every_s: float
) -> None:
    watched = Watched()
    for step in range(20):
        watched.at(speed_m_s * every_s * step, velocity_m_s=speed_m_s, later_s=every_s)
    assert watched.trust.jumped_s is None


@pytest.mark.parametrize("every_s", [0.05, 0.2, 1.0])
def test_a_braking_vehicle_does_not_jump(every_s: float) -> None:
    watched, north_m, speed_m_s = Watched(), 0.0, 10.0
    while speed_m_s > 0.0:
        watched.at(north_m, velocity_m_s=speed_m_s, later_s=every_s)
        slower = max(speed_m_s - 5.0 * every_s, 0.0)
        north_m += 0.5 * (speed_m_s + slower) * every_s
        speed_m_s = slower
    assert watched.trust.jumped_s is None


def test_the_velocity_of_a_px4_may_be_biased() -> None:
    watched = Watched(PX4)
    for _ in range(20):
        watched.at(0.0, velocity_m_s=0.7, later_s=1.0)
    assert watched.trust.jumped_s is None


def test_jumps_add_up_until_they_have_jumped_back() -> None:
    watched = Watched()
    for north_m, east_m, jumped_m in (
        (0.0, 0.0, 0.0),
        (20.0, 0.0, 20.0),
        (20.1, 0.0, 20.0),
        (20.1, 15.0, 25.0),
        (0.1, 0.0, 0.0),
    ):
        watched.at(north_m, east_m)
        assert watched.trust.jump_m() == pytest.approx(jumped_m, abs=0.2)
    watched.at(-20.0)
    assert watched.trust.jump_m((-20.0, 0.0)) == pytest.approx(0.0, abs=0.3)


def test_what_was_not_heard_of_for_long_has_not_jumped() -> None:
    watched = Watched()
    watched.at(0.0)
    watched.at(300.0, later_s=10.0)
    assert watched.trust.jumped_s is None


def test_on_the_ground_and_disarmed_an_estimate_may_be_reset() -> None:
    watched = Watched(armed=False)
    watched.at(0.0)
    watched.at(50.0)
    assert watched.trust.jumped_s is None
    watched = Watched()
    watched.at(0.0)
    watched.at(50.0)
    assert watched.trust.jump_m() > 49.0
    watched.take(watched.say.heartbeat(armed=False))
    assert watched.trust.jump_m() == 0.0


# --- reports -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("autopilot", "flags", "ratio", "words"),
    [
        (ARDUPILOT, 0x33F | 0x8000, 0.01, "the estimator reports GPS glitches"),
        (PX4, 0x33F | 0x400, 0.01, "the estimator reports GPS glitches"),
        (ARDUPILOT, 0x33F, 5.3, "the estimator rejects its GPS"),
    ],
)
def test_a_complaint_of_the_estimator_counts_when_it_is_repeated(
    autopilot: int, flags: int, ratio: float, words: str
) -> None:
    watched = Watched(autopilot)
    watched.ekf()
    watched.ekf(flags, ratio)
    watched.gps(0.0)
    watched.gps(0.0)
    assert watched.trust.complaint == "", "once may be a single sample"
    watched.ekf(flags, ratio, later_s=0.0)
    assert watched.trust.complaint == words
    for _ in range(2):
        watched.ekf()
        assert watched.trust.complaint == words, "the estimate has not come back yet"
    watched.ekf()
    assert watched.trust.complaint == ""


def test_a_fix_that_has_come_back_counts_after_two_seconds_and_again_from_the_start() -> None:
    """Only then an estimate has come back to its GPS."""
    watched = Watched()
    lost = "the GPS has lost its 3D fix"
    watched.at(0.0)
    watched.gps(0.0)
    for fix_type, seconds in ((1, 2.0), (3, 0.5), (1, 0.5), (3, 0.5)):
        for _ in range(round(seconds / 0.1)):
            watched.gps(0.0, 0.1, fix_type)
    assert watched.trust.complaint == lost
    for _ in range(12):
        watched.gps(0.0, 0.1)
    assert watched.trust.complaint == lost
    for _ in range(6):
        watched.gps(0.0, 0.1)
    assert watched.trust.complaint == ""


def test_the_jump_back_to_a_gps_that_was_lost_is_no_fault_of_its_own() -> None:
    """A real ArduCopter jumped by 6.5 m, 0.3 s after its GPS came back, a PX4 1.0 s after."""
    watched = Watched()
    watched.at(0.0)
    watched.gps(0.0)
    for step in range(20):
        watched.gps(0.0, 0.3, fix_type=1)
        watched.at(0.1 * step)
    for _ in range(11):
        watched.gps(-6.5, 0.1)
        watched.at(1.9, later_s=0.01)
    watched.at(-6.5)
    assert watched.trust.jump_m() == 0.0
    for _ in range(15):
        watched.gps(-6.5, 0.1)
        watched.at(-6.5)
    assert watched.trust.complaint == ""
    watched.at(0.0)
    assert watched.trust.jump_m() == pytest.approx(6.5, abs=0.1)


def test_the_ratio_of_a_px4_is_read_too() -> None:
    watched = Watched(PX4)
    for _ in range(3):
        watched.now += 1.0
        watched.take(watched.say("ESTIMATOR_STATUS", flags=0x33F, pos_horiz_ratio=2.0))
    assert watched.trust.complaint == "the estimator rejects its GPS"


def test_a_gps_that_leaves_the_estimate_is_a_complaint_and_one_that_never_agreed_is_not() -> None:
    watched = Watched()
    watched.at(0.0)
    for north_m in (0.4, 3.0, 7.0):
        for _ in range(4):
            watched.gps(north_m)
            watched.at(0.0)
        assert watched.trust.complaint == ""
    for _ in range(3):
        watched.gps(20.0)
        watched.at(0.0)
    assert watched.trust.complaint == "the GPS is 20 m from the estimated position"
    watched.gps(0.5)
    assert watched.trust.complaint == "the GPS is 20 m from the estimated position"
    watched.gps(0.5, 2.0)
    assert watched.trust.complaint == ""
    indoors = Watched()
    indoors.at(0.0)
    for _ in range(5):
        indoors.gps(80.0)
        indoors.at(0.0)
    assert indoors.trust.complaint == ""


def test_the_latency_of_a_gps_at_speed_is_no_distance() -> None:
    watched = Watched()
    for step in range(100):
        watched.at(25.0 * 0.05 * step, velocity_m_s=25.0)
        if step % 10 == 9:
            watched.gps(25.0 * 0.05 * step - 10.0, later_s=0.0)
    assert watched.trust.complaint == ""


def test_a_fix_that_is_lost_is_a_complaint_and_one_that_never_was_is_not() -> None:
    watched = Watched(PX4)
    for fix_type in (0, 0, 0, 3, 3):
        watched.gps(0.0, fix_type=fix_type)
        assert watched.trust.complaint == ""
    for _ in range(3):
        watched.gps(0.0, fix_type=0)
    assert watched.trust.complaint == "the GPS has lost its 3D fix"
