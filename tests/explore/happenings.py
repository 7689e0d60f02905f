"""Actions of people and faults, which the events of a scenario name.

Each takes the ship and the event's arguments. One that takes a while ends with another event.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

from mavlink_sitl import LinkFaults
from mavlink_vehicle.codec import Codec, make, mavlink
from mavlink_vehicle.storage.values import encode_value
from navigation_bridge.clients.service_requests import Service
from navigation_bridge.goals.requests import (
    ActKind,
    ActRequest,
    FollowRequest,
    FollowYaw,
    LandRequest,
    NavigateRequest,
    OffsetFrame,
    OrbitRequest,
    OrbitYaw,
    PointMode,
    ReturnRequest,
    TakeoffRequest,
    TrajectoryRequest,
    VelocityRequest,
    WaypointRequest,
    WaypointsRequest,
)
from navigation_bridge.requests.payload_requests import GimbalMode, PointGimbalRequest
from navigation_bridge.requests.trajectory_commands import TrajectoryCommands
from navigation_core.tasks.inputs.velocity_command import VelocityFrame
from navigation_core.trajectories.timed_point import TimedPoint
from tests.explore.aircraft import Aircraft
from tests.explore.exploration import Ship
from tests.explore.intruder import MetIntruder
from tests.explore.landing_mark import MARK, LandingMark
from tests.explore.liar import Liar
from tests.explore.moving_target import SOURCE, MovingTarget
from tests.explore.releases import as_named
from tests.explore.sources import others_speak, vehicle_clock
from tests.explore.stick import Stick
from tests.fleets.encounters import Intruder

_FACING_AHEAD = (0.0, 0.0, 0.0, 0.0)

Action = Callable[..., None]


# --- ROS clients ---------------------------------------------------------------------------


def navigate(
    ship: Ship,
    place: list[float],
    speed: float = 0.0,
    frame: str = "map",
    avoid: bool = False,
    orientation: list[float] | None = None,
) -> None:
    """A Navigate goal; the numbers may be anything."""
    x, y, z = (float(v) for v in place)
    a, b, c, d = orientation or _FACING_AHEAD
    ship.ask(NavigateRequest(frame, (x, y, z), (a, b, c, d), avoid, float(speed)))


_ACTS = {
    "bad": ActRequest(ActKind.WAIT, duration_s=math.nan),
    "in use": ActRequest(ActKind.SERVO, channel=1, pulse_us=1500),
    "grip": ActRequest(ActKind.GRIPPER, grabs=True),
    "look": ActRequest(ActKind.POINT, pitch_rad=-1.2, yaw_rad=0.5),
    "look ahead": ActRequest(ActKind.POINT, point=PointMode.NEUTRAL),
    "look at": ActRequest(ActKind.POINT, point=PointMode.POSITION, target=(5.0, 5.0, 0.0)),
    "look north": ActRequest(ActKind.POINT, pitch_rad=-0.3, yaw_rad=math.pi / 2, yaw_locked=True),
    "needed": ActRequest(ActKind.SERVO, required=True, channel=1, pulse_us=1500),
    "photo": ActRequest(ActKind.PHOTO),
    "servo": ActRequest(ActKind.SERVO, channel=9, pulse_us=1500),
    "trigger": ActRequest(ActKind.TRIGGER_DISTANCE, distance_m=2.0),
    "wait": ActRequest(ActKind.WAIT, duration_s=2.0),
}
"""Acts of a route; few vehicles have a camera and a gimbal"""


def route(
    ship: Ship,
    places: list[list[float]],
    speed: float = 0.0,
    hold_s: float = 0.0,
    radius: float = 0.0,
    laps: int = 0,
    mission: bool = False,
    avoid: bool = False,
    acts: list[str] | None = None,
    yaw_rate: float = 0.0,
) -> None:
    """A NavigateWaypoints goal, flown by setpoints or as a mission, with acts at each waypoint.

    The numbers may be anything.
    """
    there = tuple(_ACTS[name] for name in acts or ())
    waypoints = tuple(
        WaypointRequest(
            (float(p[0]), float(p[1]), float(p[2])),
            acceptance_radius_m=radius,
            hold_time_s=hold_s,
            acts=there,
        )
        for p in places
    )
    ship.ask(
        WaypointsRequest(waypoints, mission, laps, speed, avoid, yaw_rate_rad_s=float(yaw_rate))
    )


def orbit(
    ship: Ship,
    centre: list[float],
    radius: float,
    laps: float = 1.0,
    height: float = math.nan,
    speed: float = 0.0,
    frame: str = "map",
    yaw: str = "CENTRE",
    avoid: bool = False,
) -> None:
    """An Orbit goal; the numbers may be anything."""
    x, y = (float(v) for v in centre)
    ship.ask(
        OrbitRequest(
            frame, (x, y, 0.0), float(radius), float(height), float(laps), speed,
            OrbitYaw[yaw], avoid,
        )
    )  # fmt: skip


def follow(
    ship: Ship,
    start: list[float],
    velocity: list[float],
    offset: list[float],
    least: float = 0.0,
    speed: float = 0.0,
    duration: float = 30.0,
    stands_s: float = 10.0,
    lost_s: float = math.inf,
    lie: str = "",
    yaw: str = "TARGET",
) -> None:
    """A Follow goal, and the target that it is about; the numbers may be anything."""
    x, y, z = (float(v) for v in start)
    east, north, up = (float(v) for v in velocity)
    begun_s = ship.now_s
    moved = MovingTarget(ship, begun_s, (x, y, z), (east, north, up), stands_s, lost_s, lie)
    a, b, c = (float(v) for v in offset)
    ship.beside = moved.turn
    ship.ask(
        FollowRequest(
            SOURCE, (a, b, c), OffsetFrame.MAP, least, speed, duration, 5.0, FollowYaw[yaw]
        )
    )


def steer(
    ship: Ship,
    linear: list[float],
    rate: float,
    seconds: float,
    frame: str = "map",
    asks: bool = True,
) -> None:
    """Velocity commands for a while, with a FollowVelocity goal or without one.

    The numbers may be anything.
    """
    x, y, z = (float(v) for v in linear)
    stick = Stick(ship, VelocityFrame(frame), (x, y, z), float(rate), ship.now_s + seconds)
    ship.beside = stick.turn
    if asks:
        ship.ask(VelocityRequest())


def trajectory(ship: Ship, points: list[list[float]], topic: bool = False) -> None:
    """A FollowTrajectory goal, or a trajectory of its topic, from where the vehicle is.

    The points are a time, metres east, north and up of the vehicle, and perhaps a velocity; the
    numbers may be anything.
    """
    x, y, z = ship.truth().position_enu_m
    planned = tuple(
        TimedPoint(
            float(time_s),
            (x + float(east), y + float(north), z + float(up)),
            None if not velocity else (float(velocity[0]), float(velocity[1]), float(velocity[2])),
        )
        for time_s, east, north, up, *velocity in points
    )
    request = TrajectoryRequest("map", planned)
    if not topic:
        ship.ask(request)
    elif ship.server is not None:
        ship.server.bridge.feature(TrajectoryCommands).replace(request, ship.now_s)
        ship.server.collect()


def intruder(
    ship: Ship,
    course_deg: float,
    speed: float,
    meets_s: float,
    climb: float = 0.0,
    turn_deg_s: float = 0.0,
    passes: float = 0.0,
    number: int = 0,
) -> None:
    """Another aircraft is reported that will be where the vehicle is then if that flies on.

    Its course counts counterclockwise from the vehicle's own.
    """
    truth = ship.truth()
    east, north, up = truth.velocity_enu_m_s
    x, y, z = truth.position_enu_m
    meeting = (x + east * meets_s, y + north * meets_s, z + up * meets_s)
    own_deg = math.degrees(math.atan2(north, east)) if math.hypot(east, north) > 0.5 else 0.0
    flies = Intruder(own_deg + course_deg, speed, meets_s, climb, turn_deg_s, passes)
    ends_s = ship.now_s + meets_s + 20.0
    ship.met.append(MetIntruder(ship, flies, meeting, ship.now_s, ends_s, number).turn)


def takeoff(ship: Ship, height: float = 0.0) -> None:
    """A Takeoff goal."""
    ship.ask(TakeoffRequest(float(height)))


def land(
    ship: Ship,
    mark: list[float] | None = None,
    required: bool = True,
    retries: int = 0,
    search: float = 0.0,
    covered_below: float = 0.0,
    fault: str = "",
    fault_s: float = 0.0,
    jump: float = 0.0,
    told: bool = False,
    jump_below: float = 0.0,
) -> None:
    """A Land goal; on a mark, if there is one, east and north of the vehicle."""
    if mark is None:
        ship.ask(LandRequest())
        return
    east, north, _ = ship.truth().position_enu_m
    place = (east + mark[0], north + mark[1], 0.0)
    begins_s = ship.now_s + fault_s
    ship.beside = LandingMark(
        ship, place, covered_below, fault, begins_s, jump, told, jump_below
    ).turn
    ship.ask(LandRequest(MARK.topic, required, retries, float(search)))


def go_home(ship: Ship) -> None:
    """A ReturnToLaunch goal."""
    ship.ask(ReturnRequest())


def point(
    ship: Ship,
    mode: str,
    pitch: float = 0.0,
    yaw: float = 0.0,
    locked: bool = False,
    frame: str = "map",
    target: list[float] | None = None,
    system: int = 0,
) -> None:
    """A PointGimbal goal; the numbers may be anything."""
    x, y, z = (float(v) for v in target or (0.0, 0.0, 0.0))
    ship.ask_payload(
        PointGimbalRequest(
            GimbalMode[mode], float(pitch), float(yaw), locked, frame, (x, y, z), system
        )
    )


def photo(ship: Ship) -> None:
    """A client takes a photo."""
    ship.ask_payload(None)


def cancel(ship: Ship) -> None:
    """Cancel the active goal."""
    server = ship.server
    if server is not None and server.active:
        server.bridge.goals.cancel(server.active, ship.now_s)
        server.collect()


def pause(ship: Ship) -> None:
    """Call the pause service."""
    if ship.server is not None:
        ship.server.bridge.services.pause(ship.now_s)
        ship.server.collect()


def resume(ship: Ship) -> None:
    """Call the resume service."""
    if ship.server is not None:
        ship.server.bridge.services.resume(ship.now_s)
        ship.server.collect()


def serve(ship: Ship, service: str, mode: str = "") -> None:
    """Call hold, arm, disarm or set_mode."""
    if ship.server is not None:
        ship.server.bridge.services.serve(ship.next_number(), Service(service), ship.now_s, mode)
        ship.server.collect()


# --- ground stations and the pilot -----------------------------------------------------------


def _command(ship: Ship, command: int, *values: float, seen: bool, signed: bool = True) -> None:
    fields = {f"param{place}": value for place, value in enumerate(values, start=1)}
    message = make("COMMAND_LONG", **ship.address, command=command, **fields)
    ship.hear_station(message, seen, signed)


def station_mode(ship: Ship, mode: str, seen: bool = True, signed: bool = True) -> None:
    """A ground station, with the key or without, changes the mode, through the server or not."""
    parts = ship.mode_parameters(mode)
    _command(ship, mavlink.MAV_CMD_DO_SET_MODE, 1.0, *parts, seen=seen, signed=signed)


def station_pause(ship: Ship, go_on: bool = False, seen: bool = True) -> None:
    """DO_PAUSE_CONTINUE."""
    _command(ship, mavlink.MAV_CMD_DO_PAUSE_CONTINUE, float(go_on), seen=seen)


def station_arm(ship: Ship, arm: bool, seen: bool = True) -> None:
    """A ground station arms or disarms."""
    _command(ship, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, float(arm), seen=seen)


def station_clear(ship: Ship, seen: bool = True) -> None:
    """MISSION_CLEAR_ALL."""
    ship.hear_station(make("MISSION_CLEAR_ALL", **ship.address), seen)


def station_current(ship: Ship, seq: int, seen: bool = True) -> None:
    """MISSION_SET_CURRENT."""
    ship.hear_station(make("MISSION_SET_CURRENT", **ship.address, seq=seq), seen)


def station_upload(ship: Ship, count: int, seen: bool = True) -> None:
    """Announce another mission, and send its items without waiting for requests."""
    latitude, longitude, _ = ship.craft.home
    ship.hear_station(make("MISSION_COUNT", **ship.address, count=count), seen)
    for seq in range(count):
        item = make(
            "MISSION_ITEM_INT", **ship.address, seq=seq, frame=6, command=16, autocontinue=1,
            param4=math.nan, x=round(latitude * 1e7) + 300 * seq, y=round(longitude * 1e7), z=20.0,
        )  # fmt: skip
        ship.hear_station(item, seen)


def station_fence(ship: Ship, areas: list[dict[str, Any]], seen: bool = True) -> None:
    """Another fence: areas with "corners", or a "centre" and a "radius", each "inside" or not.

    East and north of home.
    """
    latitude, longitude, _ = ship.craft.home
    shrunk_m = 111_200.0 * math.cos(math.radians(latitude))
    points = []
    for area in areas:
        corners = area.get("corners") or [area["centre"]]
        kind = 5001 + (not area["inside"]) + (0 if "corners" in area else 2)
        value = float(area.get("radius", len(corners)))
        points += [(kind, value, east, north) for east, north in corners]
    count = make("MISSION_COUNT", **ship.address, count=len(points), mission_type=1)
    ship.hear_station(count, seen)
    for seq, (kind, value, east, north) in enumerate(points):
        item = make(
            "MISSION_ITEM_INT", **ship.address, seq=seq, frame=0, command=kind, autocontinue=1,
            param1=value, x=round((latitude + north / 111_200.0) * 1e7),
            y=round((longitude + east / shrunk_m) * 1e7), z=0.0, mission_type=1,
        )  # fmt: skip
        ship.hear_station(item, seen)


def station_goto(ship: Ship, north_m: float, height_m: float, seen: bool = True) -> None:
    """DO_REPOSITION."""
    latitude, longitude, altitude = ship.craft.home
    message = make(
        "COMMAND_INT", **ship.address, frame=0, command=mavlink.MAV_CMD_DO_REPOSITION, param1=-1.0,
        param2=1.0, param4=math.nan, x=round((latitude + north_m / 111_000.0) * 1e7),
        y=round(longitude * 1e7), z=altitude + height_m,
    )  # fmt: skip
    ship.hear_station(message, seen)


def station_param(ship: Ship, name: str, value: float, seen: bool = True) -> None:
    """PARAM_SET, of a parameter that the recorded release has, as the vehicle's names it."""
    named = as_named(ship.craft, name, value)
    if named is None:
        return
    name, value = named
    kind = int(ship.sim.firmware.parameters.specs[name].type)
    number = encode_value(value, kind, ship.craft.autopilot == "px4")
    message = make(
        "PARAM_SET", **ship.address, param_id=name.encode(), param_value=number, param_type=kind
    )
    ship.hear_station(message, seen)


def station_home(ship: Ship, offset: list[float], seen: bool = True) -> None:
    """DO_SET_HOME: north, east and up from where it was at first."""
    latitude, longitude, altitude = ship.craft.home
    north, east, up = (float(v) for v in offset)
    shrunk_m = 111_000.0 * math.cos(math.radians(latitude))
    message = make(
        "COMMAND_INT", **ship.address, frame=0, command=mavlink.MAV_CMD_DO_SET_HOME,
        x=round((latitude + north / 111_000.0) * 1e7), y=round((longitude + east / shrunk_m) * 1e7),
        z=altitude + up,
    )  # fmt: skip
    ship.hear_station(message, seen)


def pilot_mode(ship: Ship, mode: str) -> None:
    """The pilot turns the mode switch."""
    ship.sim.pilot_mode_change(mode)


def pilot_throttle(ship: Ship, pulse_us: int) -> None:
    """The pilot moves the throttle stick."""
    ship.sim.pilot_throttle(pulse_us)


def pilot_stick(ship: Ship, forward: float) -> None:
    """The pilot moves a stick forward, from -1 to 1, and keeps it there."""
    ship.stick_forward = forward
    if ship.craft.autopilot == "ardupilot":
        ship.sim.firmware.pilot.receive((0, round(1500 - 500 * forward)))


# --- trouble ---------------------------------------------------------------------------------


def link(ship: Ship, **faults: float) -> None:
    """Make the link bad; no faults mend it."""
    ship.sim.link.set_faults(LinkFaults(**faults) if faults else None)


def silence(ship: Ship, on: bool, mute: bool = False) -> None:
    """Cut the link, in one direction or both."""
    if mute:
        ship.sim.link.mute = on
    else:
        ship.sim.link.silent = on


def full(ship: Ship, on: bool) -> None:
    """The server's send buffer is full: what it sends is dropped."""
    ship.full = on


def stuck(ship: Ship, on: bool) -> None:
    """The estimator is stuck: positions are repeated with new times."""
    ship.stuck = {} if on else None


def blind(ship: Ship, on: bool) -> None:
    """The range sensors are silent."""
    ship.blind = on


def unlocated(ship: Ship, on: bool) -> None:
    """No position arrives, while all else does."""
    ship.unlocated = on


def stranger(ship: Ship, seed: int, seconds: float) -> None:
    """Another vehicle is heard on the same link: it is elsewhere, in any mode, armed or not."""
    rng, until_s, codec = random.Random(seed), ship.now_s + seconds, Codec(9, 1)
    north, east = rng.uniform(-400.0, 400.0), rng.uniform(-400.0, 400.0)
    due_s = -math.inf

    def turn() -> None:
        nonlocal due_s
        if not due_s <= ship.now_s < until_s:
            return
        due_s = ship.now_s + 0.25
        ms = round(1e3 * ship.now_s)
        messages = (
            make("HEARTBEAT", type=2, autopilot=3, base_mode=rng.choice((81, 89, 217)),
                 custom_mode=rng.randrange(10), system_status=4, mavlink_version=3),
            make("LOCAL_POSITION_NED", time_boot_ms=ms, x=north, y=east, z=-20.0, vx=3.0),
            make("EXTENDED_SYS_STATE", landed_state=rng.randrange(1, 5)),
        )  # fmt: skip
        ship.foreign += [codec.encode(message) for message in messages]

    ship.beside = turn


def clock(ship: Ship, seconds: float) -> None:
    """The clock of the server's computer is set, forward or back."""
    ship.clock_off_s += seconds


def gps(ship: Ship, lost: bool) -> None:
    """Lose the satellites, or find them."""
    if lost:
        ship.sim.lose_gps("explored")
    else:
        ship.sim.restore_gps("explored")


def glitch(ship: Ship, offset: list[float]) -> None:
    """Let the receiver be wrong: north, east, down."""
    north, east, down = (float(v) for v in offset)
    ship.sim.shift_gps((north, east, down))


def battery(ship: Ship, share: float) -> None:
    """Let the battery have a share of its charge."""
    ship.sim.set_battery_remaining(share)


def radio(ship: Ship, lost: bool) -> None:
    """Lose the pilot's radio, or find it."""
    ship.sim.lose_radio(lost)


def wind(ship: Ship, velocity: list[float]) -> None:
    """Another wind on top of the world's: north, east, down."""
    north, east, down = (float(v) for v in velocity)
    ship.sim.blow((north, east, down))


def reboot(ship: Ship) -> None:
    """The autopilot restarts where it is."""
    ship.sim.power_cycle()


def stall(ship: Ship, seconds: float) -> None:
    """The server's process stands still; what arrives waits."""
    if ship.server is not None:
        ship.server.stalled_until_s = ship.now_s + seconds


def kill(ship: Ship) -> None:
    """The server is killed."""
    ship.kill_server()


def start(ship: Ship) -> None:
    """The server is started again."""
    ship.start_server()


def shut_down(ship: Ship) -> None:
    """The server is asked to end."""
    if ship.server is not None:
        ship.server.bridge.goals.shut_down(ship.now_s)
        ship.server.collect()


def noise(ship: Ship, seed: int, count: int) -> None:
    """Bytes that are no frames, and frames of a stranger, arrive at the server."""
    rng = random.Random(seed)
    for _ in range(count):
        if rng.random() < 0.5:
            data = rng.randbytes(rng.randrange(1, 60))
        else:
            message = make(
                "HEARTBEAT", type=rng.randrange(30), autopilot=rng.choice((3, 8, 12)),
                base_mode=rng.randrange(256), custom_mode=rng.randrange(30),
                system_status=rng.randrange(9), mavlink_version=3,
            )  # fmt: skip
            data = ship.hostile.encode(message)
        ship.foreign.append(data)


def lie(ship: Ship, claim: str = "", period: float = 0.0) -> None:
    """Somebody sends with the vehicle's ids, once or each period; no lie ends them all."""
    if claim:
        ship.liars.append(Liar(ship.index + 1, claim, period))
    else:
        ship.liars = [one for one in ship.liars if isinstance(one, Aircraft)]


def misreport(ship: Ship, claim: str = "") -> None:
    """A server of shared traffic reports to the others what is not so; nothing ends it."""
    ship.misreport = claim


def aircraft(ship: Ship, claim: str = "", seed: int = 0) -> None:
    """The vehicle's ADS-B receiver passes on aircraft that cannot be; no claim ends them."""
    ship.liars = [one for one in ship.liars if isinstance(one, Liar)]
    if claim:
        ship.liars.append(Aircraft(ship.index + 1, claim, seed))


ACTIONS: dict[str, Action] = {
    action.__name__: action
    for action in (
        *(
            navigate,
            route,
            orbit,
            follow,
            steer,
            trajectory,
            intruder,
            takeoff,
            land,
            go_home,
            point,
            photo,
            cancel,
            pause,
            resume,
            serve,
        ),
        *(station_mode, station_pause, station_arm, station_clear, station_current),
        *(
            station_upload,
            station_goto,
            station_param,
            station_home,
            station_fence,
            pilot_mode,
            pilot_throttle,
        ),
        *(pilot_stick,),
        *(link, silence, full, stuck, blind, unlocated, gps, glitch, battery, radio, wind, reboot),
        *(clock, stall, kill, start, shut_down, noise, stranger, lie, misreport, aircraft),
        *(vehicle_clock, others_speak),
    )
}
