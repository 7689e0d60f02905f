"""Services of a vehicle: how they plug in, and the order in which they send."""

from __future__ import annotations

import pytest

from mavlink_vehicle.codec import Message, make, mavlink, with_source
from mavlink_vehicle.events import StoredLog, VehicleRebooted
from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.protocols.service import Conversation, SendingRank, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState
from mavlink_vehicle.vehicle import SetpointNed, Vehicle, VehicleConfig

GUIDED, LOITER, LAND = 4, 5, 9
ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
SETPOINT = SetpointNed(velocity_ned_m_s=(1.0, 0.0, 0.0))
WAYPOINT = MissionItem(
    mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_GLOBAL, x=470_000_000, y=80_000_000, z=500.0
)


def heartbeat(mode: int = GUIDED, armed: bool = True) -> Message:
    """Return an ArduCopter's HEARTBEAT."""
    message = make(
        "HEARTBEAT",
        type=mavlink.MAV_TYPE_QUADROTOR,
        autopilot=mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
        base_mode=mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (ARMED if armed else 0),
        custom_mode=mode,
        system_status=mavlink.MAV_STATE_ACTIVE,
    )
    return with_source(message, 1, 1)


def connected(further: tuple[VehicleService, ...] = (), armed: bool = True) -> Vehicle:
    """A vehicle that is heard at 0 s and has been asked all that it is asked then."""
    vehicle = Vehicle(VehicleConfig(), further)
    vehicle.start(0.0)
    vehicle.receive(heartbeat(armed=armed), 0.0)
    vehicle.handle_timer(0.0)
    sent(vehicle)
    return vehicle


def sent(vehicle: Vehicle) -> list[str]:
    """Return the messages to send: names, of commands their numbers."""
    return [
        f"{message.get_type()} {getattr(message, 'command', '')}".rstrip()
        for message in vehicle.messages_to_send()
    ]


def command(number: int) -> str:
    return f"COMMAND_LONG {number}"


class Counter(VehicleService):
    """Counts positions, and records what else it is called for."""

    rank = SendingRank.DATA
    handles = (mavlink.MAVLink_vfr_hud_message,)

    def __init__(self) -> None:
        super().__init__()
        self.calls: list[str] = []

    def start(self, now: float) -> None:
        self.calls.append("start")

    def receive(self, message: Message, now: float) -> None:
        assert isinstance(message, mavlink.MAVLink_vfr_hud_message)
        self.calls.append(f"{message.airspeed:g} m/s")
        self.events.append(VehicleRebooted(7))

    def vehicle_came(self, conversation: Conversation, now: float) -> None:
        self.calls.append(f"{conversation.profile.name} {conversation.address.target_system}")

    def link_lost(self, state: VehicleState, now: float) -> None:
        self.calls.append("lost")

    def vehicle_armed(self) -> None:
        self.calls.append("armed")


def test_a_service_plugs_in_without_a_change_of_the_vehicle() -> None:
    counter = Counter()
    vehicle = connected((counter,), armed=False)
    vehicle.receive(with_source(make("VFR_HUD", airspeed=3.0), 1, 1), 0.1)
    vehicle.receive(with_source(make("VFR_HUD", airspeed=5.0), 2, 1), 0.1)  # another vehicle's
    vehicle.receive(heartbeat(), 0.2)
    events = []
    while (event := vehicle.next_event()) is not None:
        events.append(event)
    assert VehicleRebooted(7) in events
    for now in (1.0, 2.0, 3.0, 4.0):
        vehicle.handle_timer(now)
    vehicle.receive(heartbeat(), 5.0)
    assert counter.calls == [
        "start", "ArduCopter 1", "3 m/s", "armed", "lost", "ArduCopter 1"
    ]  # fmt: skip
    counter.outbox.append(make("PING"))
    assert sent(vehicle)[-1] == "PING"


def test_the_mode_is_asked_for_before_anything_else_after_a_gap() -> None:
    """A service that commands waits for its answer; a command under way is dropped meanwhile."""
    vehicle = connected()
    vehicle.setpoints.open(0.0)
    vehicle.send_setpoint(SETPOINT, 0.1)
    vehicle.hold(0.1)
    vehicle.handle_timer(5.0)
    vehicle.handle_timer(5.2)
    names = sent(vehicle)
    assert names[0] == command(mavlink.MAV_CMD_REQUEST_MESSAGE)
    assert "HEARTBEAT" in names
    assert not {command(mavlink.MAV_CMD_DO_SET_MODE), "SET_POSITION_TARGET_LOCAL_NED"} & {*names}


def test_the_end_of_a_download_goes_out_before_what_arms() -> None:
    """An ArduPilot rejects arming while it sends a log."""
    vehicle = connected(armed=False)
    vehicle.logs.download(StoredLog(1, 1000, 0), 0, 0.1)
    sent(vehicle)
    vehicle.arm(0.2)
    vehicle.logs.stop("the vehicle is armed")
    names = sent(vehicle)
    assert names.index("LOG_REQUEST_END") < names.index(
        command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM)
    )


def test_the_end_of_a_reading_goes_out_before_the_upload_that_follows_it() -> None:
    """A PX4 takes a MISSION_ACK that comes after MISSION_COUNT for the end of the upload."""
    vehicle = connected()
    vehicle.handle_timer(0.1)  # the fence is being read
    vehicle.missions.upload([WAYPOINT], 0.2)
    names = sent(vehicle)
    assert names.index("MISSION_ACK") < names.index("MISSION_COUNT")


def test_of_one_moment_a_mode_goes_out_first_then_the_setpoint_and_last_the_data() -> None:
    """A setpoint before its mode is ignored; what is repeated or replaced can wait."""
    vehicle = connected()
    vehicle.setpoints.open(0.9)
    vehicle.send_setpoint(SETPOINT, 1.0)
    vehicle.rtcm.offer(bytes.fromhex("d300133ed7d30202980edeef34b4bd62ac0941986f33360b98"), 1.0)
    vehicle.change_mode("GUIDED", 1.0)
    vehicle.hold(1.0)
    vehicle.parameters.read(["WP_SPD"], 1.0)
    vehicle.handle_timer(1.0)
    names = sent(vehicle)
    order = [
        command(mavlink.MAV_CMD_DO_SET_MODE),
        "SET_POSITION_TARGET_LOCAL_NED",
        "HEARTBEAT",
        "PARAM_REQUEST_READ",
        "GPS_RTCM_DATA",
    ]
    places = [names.index(name) for name in order]
    assert places == sorted(places)


@pytest.mark.parametrize("obeyed", [False, True])
def test_the_mode_is_asked_for_while_a_command_may_overtake_a_stations(obeyed: bool) -> None:
    """With the operation under way, and after its end."""
    vehicle = connected()
    vehicle.hold(1.0)
    if obeyed:
        vehicle.receive(heartbeat(LOITER), 1.05)
    vehicle.handle_timer(1.05)
    sent(vehicle)
    land = make("SET_MODE", target_system=1, base_mode=1, custom_mode=LAND)
    vehicle.overhear(with_source(land, 255, 190), 1.1)
    assert vehicle.operations.choice_is_unclear
    assert (vehicle.operations.pending is None) is obeyed
    assert vehicle.next_deadline() == 1.1
    vehicle.handle_timer(1.1)
    assert sent(vehicle) == [command(mavlink.MAV_CMD_REQUEST_MESSAGE)]
    assert vehicle.operations.deadline_s is not None
    assert 1.1 < vehicle.operations.deadline_s < 1.5


def test_each_rank_is_that_of_a_service() -> None:
    ranks = {service.rank for service in Vehicle().services}
    assert ranks == {*SendingRank}
