"""Encounters with traffic that nobody leads: it flies on whatever happens, and is seen by ADS-B.

The vehicle flies the simulator, on one simulated clock; distances are ground truth. A intruder
would hit it if it did nothing: it is where the vehicle would be at one moment.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, replace

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, Message, make, mavlink
from navigation_core.geometry import Vector3
from navigation_core.tasks.traffic.intruders import TURNS_M_S2
from navigation_core.tasks.traffic.volumes import Separation
from tests.fleets.flown import TICK_S, FlownFleet

REPORTED_FROM_S, REPORT_PERIOD_S = 0.6, 1.0
_REVERSES_S = 0.5
_ALL_FLAGS = (
    mavlink.ADSB_FLAGS_VALID_COORDS
    | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    | mavlink.ADSB_FLAGS_VALID_HEADING
    | mavlink.ADSB_FLAGS_VALID_VELOCITY
    | mavlink.ADSB_FLAGS_VERTICAL_VELOCITY_VALID
)


@dataclass(frozen=True)
class Intruder:
    """Another aircraft on a collision course.

    Attributes:
        course_deg: where it flies to when it would hit: 0 along with the vehicle, 180 head on,
            90 to its left, 270 to its right.
        speed_m_s: over ground.
        meets_s: when it would hit, counted from the goal's start.
        climb_m_s: how fast it climbs.
        turn_deg_s: how fast it turns, to the left.
        passes_m: by how much it passes beside the vehicle, to its own left.
        address: its ICAO address.
    """

    course_deg: float
    speed_m_s: float
    meets_s: float = 12.0
    climb_m_s: float = 0.0
    turn_deg_s: float = 0.0
    passes_m: float = 0.0
    address: int = 0xABCDEF

    @property
    def turn_m_s2(self) -> float:
        """Return its acceleration to the left."""
        return self.speed_m_s * math.radians(self.turn_deg_s)

    def at(self, meeting_m: Vector3, time_s: float) -> tuple[Vector3, Vector3]:
        """Return where it is and how it moves, east, north and up.

        Args:
            meeting_m: where it would hit.
            time_s: time from the goal's start.
        """
        left_s = time_s - self.meets_s
        course = math.radians(self.course_deg)
        turn = math.radians(self.turn_deg_s)
        heading = course + turn * left_s
        if abs(turn) < 1e-6:
            along, aside = self.speed_m_s * left_s, 0.0
        else:
            radius = self.speed_m_s / turn
            along, aside = radius * math.sin(turn * left_s), radius * (1 - math.cos(turn * left_s))
        aside += self.passes_m
        east = along * math.cos(course) - aside * math.sin(course)
        north = along * math.sin(course) + aside * math.cos(course)
        x, y, z = meeting_m
        velocity = (self.speed_m_s * math.cos(heading), self.speed_m_s * math.sin(heading))
        return (
            (x + east, y + north, z + self.climb_m_s * left_s),
            (*velocity, self.climb_m_s),
        )


@dataclass(frozen=True)
class Flown:
    """How an encounter went.

    Attributes:
        share: the least true separation, as a share of the demanded one; 1 is as demanded.
        level_m: the level distance then.
        upright_m: the difference of altitudes then.
        took_s: how long the goal took.
        code: how it ended.
        statuses: of its feedback.
        farthest_m: how far from the straight line the vehicle has been.
        first_share: the separation at the first report, as such a share.
    """

    share: float
    level_m: float
    upright_m: float
    took_s: float
    code: str
    statuses: tuple[str, ...]
    farthest_m: float
    first_share: float


def adsb(
    fleet: FlownFleet,
    place_enu_m: Vector3,
    velocity_enu_m_s: Vector3,
    address: int = 0xABCDEF,
    **fields: object,
) -> Message:
    """Return an ADSB_VEHICLE about a place relative to the first vehicle's home."""
    east, north, up = place_enu_m
    home = fleet.simulation.vehicles[0].frame.to_geodetic(north, east, -up)
    v_east, v_north, v_up = velocity_enu_m_s
    values: dict[str, object] = {
        "ICAO_address": address,
        "lat": round(home.latitude_deg * 1e7),
        "lon": round(home.longitude_deg * 1e7),
        "altitude_type": mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
        "altitude": round(home.altitude_amsl_m * 1e3),
        "heading": round(math.degrees(math.atan2(v_east, v_north)) * 100) % 36000,
        "hor_velocity": min(round(math.hypot(v_east, v_north) * 100), 65535),
        "ver_velocity": round(v_up * 100),
        "callsign": b"INTRUDER",
        "emitter_type": 1,
        "tslc": 0,
        "flags": _ALL_FLAGS,
        "squawk": 0,
    }
    return make("ADSB_VEHICLE", **(values | fields))


def hear(fleet: FlownFleet, message: Message, row: int = 0) -> None:
    """Give a vehicle's bridge a message of its autopilot's."""
    for heard in Codec(1, 1).decode(Codec(1, 1).encode(message)):
        fleet.crafts[row].bridge.receive(heard, fleet.now)


def begin(
    kind: str = "copter",
    autopilot: str = "ardupilot",
    height_m: float = 10.0,
    speed_m_s: float = 4.0,
    vehicle: dict[str, float] | None = None,
    **parameters: object,
) -> FlownFleet:
    """Return one vehicle, with parameters of its autopilot, that stands, or hovers, at its home."""
    config = VehicleConfig(kind, autopilot, ready_after_s=1.0, parameters=vehicle or {})
    settings = {"speed_default_m_s": speed_m_s, "speed_max_m_s": max(speed_m_s, 5.0), **parameters}
    fleet = FlownFleet([config], **settings).ready()  # type: ignore[arg-type]
    if kind == "copter":
        fleet.go(fleet.crafts[0], 0.0, 0.0, height_m)
        fleet.run_to_end()
    return fleet


def meet(
    fleet: FlownFleet,
    intruders: Sequence[Intruder],
    goal_m: float = 80.0,
    height_m: float = 10.0,
    speed_m_s: float = 4.0,
    timeout_s: float = 260.0,
) -> Flown:
    """Fly a goal east among intruders, each of which would hit the vehicle if it flew straight."""
    (craft,) = fleet.crafts
    separation = Separation()
    begun_s, due_s = fleet.now, REPORTED_FROM_S
    before = len(craft.ends())
    worst = (math.inf, math.inf, math.inf)
    farthest_m, first = 0.0, math.inf
    start_s = 0.5 * speed_m_s / 2.0 + 0.3
    meetings = [
        (min(max(one.meets_s - start_s, 0.0) * speed_m_s, goal_m), 0.0, height_m)
        for one in intruders
    ]

    def watch(now: float) -> None:
        nonlocal due_s, worst, farthest_m, first
        time_s = now - begun_s
        north, east, down = fleet.simulation.positions_ned_m[0]
        farthest_m = max(farthest_m, abs(float(north)), abs(float(-down) - height_m))
        reports = time_s >= due_s
        due_s += REPORT_PERIOD_S if reports else 0.0
        for one, meeting in zip(intruders, meetings, strict=True):
            place, velocity = one.at(meeting, time_s)
            level_m = math.hypot(place[0] - east, place[1] - north)
            upright_m = abs(place[2] + float(down))
            share = max(level_m / separation.horizontal_m, upright_m / separation.vertical_m)
            worst = min(worst, (share, level_m, upright_m))
            if REPORTED_FROM_S <= time_s < REPORTED_FROM_S + TICK_S:
                first = min(first, share)
            if reports:
                hear(fleet, adsb(fleet, place, velocity, one.address))

    fleet.on_tick = watch
    fleet.go(craft, goal_m, 0.0, height_m)
    last_s = max(one.meets_s for one in intruders) + 3.0
    fleet.run_until(lambda: fleet.now - begun_s > last_s and len(craft.ends()) > before, timeout_s)
    fleet.on_tick = None
    end_s, end = craft.ends()[-1]
    statuses = tuple(craft.statuses())
    return Flown(*worst, end_s - begun_s, end.code.value, statuses, farthest_m, first)


def apart(intruders: Sequence[Intruder]) -> list[Intruder]:
    """Return intruders with addresses of their own."""
    return [replace(one, address=one.address + index) for index, one in enumerate(intruders)]


def reach_m(time_s: float, speed_m_s: float, acceleration_m_s2: float) -> float:
    """Return how far a vehicle gets aside in a time."""
    gains_s = min(time_s, speed_m_s / acceleration_m_s2)
    return 0.5 * acceleration_m_s2 * gains_s * gains_s + speed_m_s * max(time_s - gains_s, 0.0)


def can_keep_apart(intruders: Sequence[Intruder], flown: Flown, speed_m_s: float) -> bool:
    """Whether a copter could have kept the separation, had it acted a second after the report.

    Of those that turn harder than is allowed for, the second report tells where they go; then the
    vehicle may have to reverse what it has begun.
    """
    left_s = min(one.meets_s - _known_s(one) for one in intruders) - 1.0
    return flown.first_share >= 1.5 and reach_m(left_s, speed_m_s, 2.0) >= 6.0


def _known_s(intruder: Intruder) -> float:
    turns = abs(intruder.turn_m_s2) > TURNS_M_S2
    return REPORTED_FROM_S + (REPORT_PERIOD_S + _REVERSES_S if turns else 0.0)


def random_encounter(seed: int, climbs: bool = True) -> list[Intruder]:
    """Return up to three intruders from anywhere, 1 to 60 m/s, that would hit after 2 to 20 s."""
    draw = random.Random(seed)
    speeds_m_s = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0, 35.0, 60.0)
    return apart(
        [
            Intruder(
                draw.uniform(0.0, 360.0),
                draw.choice(speeds_m_s) * draw.uniform(0.8, 1.0),
                draw.uniform(2.0, 20.0),
                climb_m_s=draw.choice((0.0, 0.0, 0.0, 2.0, -2.0, 1.0)) if climbs else 0.0,
                turn_deg_s=draw.choice((0.0, 0.0, 0.0, 6.0, -6.0, 3.0, -3.0)),
            )
            for _ in range(draw.choice((1, 1, 1, 2, 3)))
        ]
    )


def turning_encounter(seed: int) -> list[Intruder]:
    """Return such intruders that turn by up to 3 m/s^2, but by no more than 30 degrees a second."""
    draw = random.Random(seed)
    turns_m_s2 = [draw.uniform(-3.0, 3.0) for _ in range(3)]
    return [
        replace(one, turn_deg_s=max(-30.0, min(30.0, math.degrees(turn_m_s2 / one.speed_m_s))))
        for one, turn_m_s2 in zip(random_encounter(seed + 1000), turns_m_s2, strict=False)
    ]
