"""Missions written, read and started on simulated vehicles, over good links and bad."""

from __future__ import annotations

import math

import pytest

from mavlink_sitl import LinkFaults
from mavlink_sitl import VehicleConfig as SimulatedVehicleConfig
from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationFinished, OperationResult
from mavlink_vehicle.mission_items import (
    AMSL,
    NO_FRAME,
    RELATIVE_ALT,
    MissionItem,
)
from tests.support.flights.vehicle_pair import BAD_RADIO, WORSE_RADIO, VehiclePair

pytestmark = pytest.mark.wide


HOME_1E7 = (-353632610, 1491652300)
METRE_1E7 = 1e7 / 111_319.0
KINDS = [
    ("ardupilot", "copter"), ("ardupilot", "rover"), ("ardupilot", "plane"), ("px4", "copter"),
    ("px4", "rover"), ("px4", "plane"),
]  # fmt: skip


def take_off(height_m: float) -> MissionItem:
    return MissionItem(mavlink.MAV_CMD_NAV_TAKEOFF, RELATIVE_ALT, (0.0, 0.0, 0.0, math.nan),
                       *HOME_1E7, height_m)  # fmt: skip


def waypoint(north_m: float, height_m: float = 5.0, stay_s: float = 0.0) -> MissionItem:
    x = HOME_1E7[0] + round(north_m * METRE_1E7)
    return MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, RELATIVE_ALT, (stay_s, 0.0, 0.0, math.nan),
                       x, HOME_1E7[1], height_m)  # fmt: skip


def speed(speed_m_s: float) -> MissionItem:
    return MissionItem(mavlink.MAV_CMD_DO_CHANGE_SPEED, NO_FRAME, (1.0, speed_m_s, -1.0, 0.0))


MISSION = [take_off(5.0), speed(3.0), waypoint(12.3), waypoint(-7.1, 6.25)]


def pair_of(
    autopilot: str = "ardupilot", vehicle: str = "copter", faults: LinkFaults | None = None
) -> VehiclePair:
    simulated = SimulatedVehicleConfig(
        autopilot=autopilot, vehicle=vehicle, ready_after_s=1.0, faults=faults
    )
    return VehiclePair(simulated=simulated, faults=faults).ready()


def upload(pair: VehiclePair, items: list[MissionItem]) -> OperationFinished:
    return pair.finish(pair.vehicle.missions.upload(items, pair.now), 90.0)


@pytest.mark.parametrize(("autopilot", "vehicle"), KINDS)
def test_what_is_uploaded_can_be_read_back_and_cleared(autopilot: str, vehicle: str) -> None:
    pair = pair_of(autopilot, vehicle)
    end = upload(pair, MISSION)
    assert end.result is OperationResult.ACHIEVED, end.reason
    end = pair.finish(pair.vehicle.missions.download(pair.now))
    assert end.result is OperationResult.ACHIEVED, end.reason
    stored = pair.vehicle.missions.stored
    assert stored is not None
    assert [(item.command, item.x) for item in stored[2:]] == [
        (item.command, item.x) for item in MISSION[2:]
    ]
    pair.run_for(1.0)
    mission = pair.vehicle.state.mission
    assert mission is not None
    assert mission.total == len(MISSION)
    assert (mission.mission_id != 0) == (autopilot == "px4")
    end = pair.finish(pair.vehicle.missions.clear(pair.now))
    assert end.result is OperationResult.ACHIEVED, end.reason
    assert pair.vehicle.missions.stored == ()
    pair.run_for(1.0)
    mission = pair.vehicle.state.mission
    assert mission is not None
    assert (mission.total, mission.state) == (0, mavlink.MISSION_STATE_NO_MISSION)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
@pytest.mark.parametrize(
    "faults",
    [BAD_RADIO, WORSE_RADIO, LinkFaults(loss=0.4), LinkFaults(duplicate=0.5, jitter_s=0.5)],
    ids=["bad", "worse", "loss", "disorder"],
)
def test_an_upload_survives_a_bad_link(autopilot: str, faults: LinkFaults) -> None:
    pair = pair_of(autopilot, faults=faults)
    end = upload(pair, MISSION)
    assert end.result is OperationResult.ACHIEVED, end.reason


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_copter_takes_off_and_flies_its_mission(autopilot: str) -> None:
    pair = pair_of(autopilot)
    vehicle = pair.vehicle
    assert upload(pair, MISSION).result is OperationResult.ACHIEVED
    refused = pair.finish(vehicle.missions.start(pair.now))
    assert refused.result is OperationResult.REFUSED
    assert "disarmed" in refused.reason
    if autopilot == "ardupilot":
        assert pair.finish(vehicle.take_control(pair.now)).result is OperationResult.ACHIEVED
    assert pair.finish(vehicle.arm(pair.now)).result is OperationResult.ACHIEVED
    end = pair.finish(vehicle.missions.start(pair.now))
    assert end.result is OperationResult.ACHIEVED, end.reason
    pair.run_until(
        lambda: (
            vehicle.state.mission is not None
            and vehicle.state.mission.state == mavlink.MISSION_STATE_COMPLETE
        )
    )
    mission = vehicle.state.mission
    assert mission is not None
    first = 1 if autopilot == "ardupilot" else 0
    reached = [seq - first for seq in mission.reached]
    assert reached == sorted(set(reached)), "each once"
    # Of the items that are done at one moment, only the last is reported: here the speed.
    assert reached == [1, 2, 3]


def test_ardupilot_keeps_the_mission_that_it_flies_and_px4_loiters() -> None:
    for autopilot in ("ardupilot", "px4"):
        pair = pair_of(autopilot)
        vehicle = pair.vehicle
        assert upload(pair, MISSION).result is OperationResult.ACHIEVED
        if autopilot == "ardupilot":
            pair.finish(vehicle.take_control(pair.now))
        pair.finish(vehicle.arm(pair.now))
        assert pair.finish(vehicle.missions.start(pair.now)).result is OperationResult.ACHIEVED
        pair.run_for(8.0)
        end = pair.finish(vehicle.missions.clear(pair.now))
        pair.run_for(2.0)
        if autopilot == "ardupilot":
            assert end.result is OperationResult.REFUSED
            assert "in AUTO" in end.reason
            assert vehicle.mode_name == "AUTO"
        else:
            assert end.result is OperationResult.ACHIEVED, end.reason
            assert vehicle.mode_name == "AUTO.LOITER"


def test_px4_rejects_flying_without_a_mission() -> None:
    pair = pair_of("px4")
    vehicle = pair.vehicle
    pair.finish(vehicle.arm(pair.now))
    end = pair.finish(vehicle.missions.start(pair.now), 30.0)
    assert end.result is not OperationResult.ACHIEVED


def test_an_item_that_the_vehicle_does_not_take_is_named() -> None:
    unknown = MissionItem(mavlink.MAV_CMD_NAV_PATHPLANNING, RELATIVE_ALT, x=1, y=1)
    for autopilot in ("ardupilot", "px4"):
        pair = pair_of(autopilot)
        end = upload(pair, [*MISSION, unknown])
        assert end.result is OperationResult.REFUSED
        assert "does not support an item's command" in end.reason
    bad_frame = MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_LOCAL_NED)
    end = upload(pair_of(), [bad_frame])
    assert "does not support the frame" in end.reason
    end = upload(pair_of(), [waypoint(1.0)] * 700)
    assert end.result is OperationResult.REFUSED
    assert "no space" in end.reason
    assert "Only 650 items are supported" in end.reason


def test_a_cancelled_upload_leaves_an_ardupilot_with_a_mission_cut_short() -> None:
    pair = pair_of()
    assert upload(pair, MISSION).result is OperationResult.ACHIEVED
    operation = pair.vehicle.missions.upload([take_off(7.0)], pair.now)
    pair.flush()
    pair.vehicle.operations.abandon(pair.now)
    end = pair.finish(operation)
    assert end.result is OperationResult.CANCELLED
    assert "MISSION_ACK" in pair.names_sent()
    pair.finish(pair.vehicle.missions.download(pair.now))
    assert len(pair.vehicle.missions.stored or ()) < len(MISSION)


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_a_new_mission_begins_at_its_own_first_item(autopilot: str) -> None:
    pair = pair_of(autopilot)
    assert upload(pair, MISSION).result is OperationResult.ACHIEVED
    assert pair.copter.firmware.auto.set_current(3) == mavlink.MAV_RESULT_ACCEPTED
    pair.run_for(1.5)
    assert pair.vehicle.state.mission is not None
    assert pair.vehicle.state.mission.current == 3
    assert upload(pair, MISSION).result is OperationResult.ACHIEVED
    pair.run_for(1.0)
    mission = pair.vehicle.state.mission
    assert mission is not None
    assert mission.current == (1 if autopilot == "ardupilot" else 0)


def test_a_restart_ends_an_upload() -> None:
    pair = pair_of()
    operation = pair.vehicle.missions.upload(MISSION, pair.now)
    pair.flush()
    pair.reboot()
    end = pair.finish(operation)
    assert end.result is OperationResult.LINK_LOST
    assert "restarted" in end.reason


def test_amsl_heights_come_back_as_they_were() -> None:
    place = MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, AMSL, (0, 0, 0, 90.0), *HOME_1E7, 612.37)
    for autopilot in ("ardupilot", "px4"):
        pair = pair_of(autopilot)
        end = upload(pair, [take_off(3.0), place])
        assert end.result is OperationResult.ACHIEVED, end.reason


@pytest.mark.parametrize("autopilot", ["ardupilot", "px4"])
def test_the_end_of_reading_back_is_acknowledged(autopilot: str) -> None:
    """A real PX4 that gets no MISSION_ACK says "Operation timeout" five seconds later."""
    pair = pair_of(autopilot)
    since = len(pair.sent)
    assert upload(pair, MISSION).result is OperationResult.ACHIEVED
    pair.run_for(0.1)
    names = [message.get_type() for _, message in pair.sent[since:]]
    told = [name for name in names if name.startswith("MISSION_")]
    assert told[-1] == "MISSION_ACK"
    assert told.count("MISSION_ACK") == 1
