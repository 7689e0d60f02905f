"""Makes a scenario from one number."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

from tests.explore import sources
from tests.explore.aircraft import AIRCRAFT
from tests.explore.liar import LIES
from tests.explore.misreports import MISREPORTS
from tests.explore.more_situations import MORE_SITUATIONS_FROM, write_more
from tests.explore.releases import RELEASES
from tests.explore.scenario import Craft, Event, Post, Scenario
from tests.explore.situations import SITUATIONS_FROM, write_situation

SHARING_FROM = 2**40
"""Seeds from here on are copters that share traffic"""

LYING = 2**39
"""Seeds with this bit are the same with somebody who lies"""

UNSAFE = 2**38
"""Seeds with this bit are the same with ground stations that do what is legal at bad moments"""

_HOMES = (
    (-35.363261, 149.165230, 584.0),
    (47.397742, 8.545594, 488.0),
    (0.002, -0.003, 12.0),
    (-54.8, -68.3, 30.0),
    (69.65, 18.95, 3.0),
    (21.3, 179.9995, 5.0),
)
_CRAFTS = (
    *(("copter", "ardupilot"),) * 5,
    *(("copter", "px4"),) * 4,
    *(("rover", "ardupilot"),) * 2,
    ("rover", "px4"),
    ("boat", "ardupilot"),
    *(("plane", "ardupilot"),) * 2,
    ("plane", "px4"),
)
_PILOT_MODES = {
    ("copter", "ardupilot"): ("LOITER", "ALT_HOLD", "STABILIZE", "BRAKE", "RTL", "LAND", "GUIDED"),
    ("copter", "px4"): ("POSCTL", "ALTCTL", "AUTO.LOITER", "AUTO.RTL", "AUTO.LAND"),
    ("rover", "ardupilot"): ("MANUAL", "HOLD", "RTL", "GUIDED"),
    ("boat", "ardupilot"): ("MANUAL", "HOLD", "LOITER", "RTL"),
    ("rover", "px4"): ("MANUAL", "AUTO.LOITER", "AUTO.RTL"),
    ("boat", "px4"): ("MANUAL", "AUTO.LOITER"),
    ("plane", "ardupilot"): ("LOITER", "FLY_BY_WIRE_A", "RTL", "GUIDED"),
    ("plane", "px4"): ("AUTO.LOITER", "AUTO.RTL", "POSCTL"),
}
_SERVER: tuple[tuple[str, tuple[Any, ...]], ...] = (
    ("arming", ("auto", "auto", "pilot", "never", "never")),
    ("on_new_goal", ("replace", "reject")),
    ("on_missed_waypoint", ("continue", "turn_back")),
    ("setpoint_rate_hz", (5.0, 10.0, 30.0, 50.0)),
    ("feedback_rate_hz", (2.0, 5.0, 20.0)),
    ("position_rate_hz", (5.0, 10.0, 50.0)),
    ("speed_default_m_s", (0.5, 1.0, 5.0, 8.0)),
    ("speed_max_m_s", (1.0, 4.0, 15.0)),
    ("speed_up_m_s", (0.5, 3.0)),
    ("speed_down_m_s", (0.5, 2.0)),
    ("acceleration_horizontal_m_s2", (0.5, 1.0, 4.0)),
    ("jerk_m_s3", (1.0, 20.0)),
    ("yaw_rate_deg_s", (15.0, 120.0)),
    ("arrival_radius_m", (0.3, 1.0, 3.0)),
    ("link_lost_abort_s", (4.0, 20.0)),
    ("position_doubt_timeout_s", (5.0, 20.0)),
    ("cancel_timeout_s", (3.0, 20.0)),
    ("takeoff_height_m", (2.0, 5.0)),
    ("battery_policy", ("reject", "warn", "ignore")),
    ("volume_radius_m", (60.0, 1000.0)),
    ("volume_altitude_max_m", (30.0,)),
    ("blocked_timeout_s", (5.0, 15.0)),
)
_LASTS_S = (15.0, 40.0, 80.0, 120.0)
_ONBOARD: dict[tuple[str, str], tuple[tuple[str, tuple[float, ...]], ...]] = {
    ("copter", "ardupilot"): (
        ("WPNAV_SPEED", (100.0, 1500.0)), ("WPNAV_SPEED_UP", (60.0, 500.0)),
        ("WPNAV_SPEED_DN", (60.0, 300.0)), ("RTL_ALT", (0.0, 3000.0)),
        ("FENCE_ENABLE", (1.0,)), ("FENCE_RADIUS", (30.0, 60.0)), ("FS_GCS_ENABLE", (1.0,)),
        ("BATT_LOW_MAH", (1500.0,)),
    ),
    ("copter", "px4"): (
        ("MPC_XY_CRUISE", (2.0, 12.0)), ("MPC_XY_VEL_MAX", (3.0, 15.0)),
        ("MPC_Z_VEL_MAX_UP", (1.0, 5.0)), ("RTL_RETURN_ALT", (5.0, 60.0)),
        ("COM_OF_LOSS_T", (0.3, 5.0)), ("NAV_DLL_ACT", (0.0, 2.0)), ("GF_ACTION", (1.0, 2.0)),
        ("GF_MAX_HOR_DIST", (30.0, 60.0)),
    ),
    ("rover", "ardupilot"): (
        ("WP_SPEED", (0.5, 5.0)), ("WP_RADIUS", (0.5, 5.0)), ("FS_GCS_ENABLE", (1.0,)),
    ),
}  # fmt: skip
# Parameters that a ground station sets in flight: legal, and not always wise.
_SET_IN_FLIGHT: dict[tuple[str, str], tuple[tuple[str, tuple[float, ...]], ...]] = {
    ("copter", "ardupilot"): (
        *_ONBOARD["copter", "ardupilot"],
        ("GUID_TIMEOUT", (0.1, 0.5, 3.0, 10.0)), ("WPNAV_ACCEL", (50.0, 500.0)),
        ("FENCE_ALT_MAX", (10.0, 100.0)), ("FENCE_ACTION", (0.0, 1.0, 2.0, 4.0)),
        ("BATT_FS_LOW_ACT", (0.0, 1.0, 2.0)), ("FS_THR_ENABLE", (0.0, 1.0, 3.0)),
        ("ARMING_CHECK", (0.0, 1.0)), ("WPNAV_RADIUS", (10.0, 1000.0)),
    ),
    ("copter", "px4"): (
        *_ONBOARD["copter", "px4"],
        ("COM_OBL_RC_ACT", (0.0, 3.0, 4.0, 5.0)), ("NAV_RCL_ACT", (1.0, 2.0, 3.0)),
        ("COM_LOW_BAT_ACT", (0.0, 2.0, 3.0)), ("MPC_XY_VEL_MAX", (1.0, 12.0)),
        ("NAV_ACC_RAD", (1.0, 20.0)), ("COM_OF_LOSS_T", (0.0, 60.0)),
    ),
    ("rover", "ardupilot"): (
        *_ONBOARD["rover", "ardupilot"], ("WP_SPEED", (0.2, 10.0)),
    ),
}  # fmt: skip
# More of these, for seeds with the bit UNSAFE: at the limits that the autopilots accept.
_UNSAFE_SETTINGS: dict[tuple[str, str], tuple[tuple[str, tuple[float, ...]], ...]] = {
    ("copter", "ardupilot"): (
        *_SET_IN_FLIGHT["copter", "ardupilot"],
        ("RTL_SPEED", (0.0, 2000.0)), ("RTL_LOIT_TIME", (0.0, 60000.0)),
        ("LAND_SPEED", (30.0, 200.0)), ("WPNAV_ACCEL_Z", (50.0, 500.0)),
        ("WPNAV_JERK", (1.0, 20.0)), ("FS_EKF_ACTION", (1.0, 2.0, 3.0)),
        ("FS_GCS_TIMEOUT", (2.0, 120.0)), ("DISARM_DELAY", (0.0, 1.0, 127.0)),
        ("FENCE_TYPE", (1.0, 2.0, 3.0)), ("FENCE_MARGIN", (1.0, 10.0)),
    ),
    ("copter", "px4"): (
        *_SET_IN_FLIGHT["copter", "px4"],
        ("MPC_ACC_HOR", (2.0, 15.0)), ("MPC_JERK_AUTO", (1.0, 80.0)),
        ("MPC_TKO_SPEED", (1.0, 5.0)), ("MPC_LAND_SPEED", (0.6, 2.0)),
        ("MPC_Z_V_AUTO_UP", (0.5, 8.0)), ("MPC_Z_V_AUTO_DN", (0.5, 4.0)),
        ("COM_DL_LOSS_T", (5.0, 300.0)), ("COM_DISARM_LAND", (0.1, 20.0)),
        ("RTL_TYPE", (0.0, 1.0, 3.0)), ("GF_MAX_VER_DIST", (5.0, 60.0)),
    ),
    ("rover", "ardupilot"): _SET_IN_FLIGHT["rover", "ardupilot"],
}  # fmt: skip
# Where they stand, east and north of the first one, and in whose places they change.
_SHARED_PLACES_M = ((0.0, 0.0), (12.0, 0.0), (6.0, 10.0))
_SWAPS = ((1, 0, 2), (1, 2, 0), (2, 0, 1))
_METRES_PER_DEGREE = 111_200.0
# With these an ArduCopter lands on a target.
_LANDS_ON_TARGETS = {"PLND_ENABLED": 1.0, "PLND_TYPE": 1.0}
_GOALS = ("navigate", "route", "orbit", "follow", "takeoff", "land", "go_home")
_BAD_NUMBERS = (math.nan, math.inf, -math.inf, 1e9, -1e9, 1e-300)


class _Author:
    """Writes one scenario."""

    def __init__(self, seed: int) -> None:
        self.lying, self.unsafe = bool(seed & LYING), bool(seed & UNSAFE)
        self.whole_seed, seed = seed, seed & ~(LYING | UNSAFE)
        self.rng = random.Random(seed)
        self.seed = seed
        self.events: list[Event] = []
        self.crafts: list[Craft] = []
        self.last_s = self.rng.choice(_LASTS_S)
        self.mood = self.rng.choice(("clients", "stations", "trouble", "all", "all"))

    def write(self) -> Scenario:
        rng = self.rng
        count = rng.choice((1, 1, 1, 1, 1, 2, 2, 3, 4))
        home = rng.choice(_HOMES)
        for index in range(count):
            self.crafts.append(self._craft(home, index))
        # A plane is guided by its own autopilot, around nothing.
        alone = count == 1 and self.crafts[0].kind != "plane"
        posts = self._posts() if rng.random() < 0.25 and alone else ()
        for index in range(count):
            self._people(index, bool(posts))
            if self.mood in ("stations", "all"):
                self._stations(index)
                self._settings(index)
            if self.mood in ("trouble", "all"):
                self._trouble(index)
            self._pilot(index)
            self.events += sources.drawn(self.seed, index, self.last_s)
            self._release(index)
            self._payload(index)
            self._trajectories(index)
            if self.lying:
                self._lies(index)
            if self.unsafe:
                self._unsafe(index)
        wind = rng.uniform(0.0, 7.0) if rng.random() < 0.4 else 0.0
        angle = rng.uniform(0.0, math.tau)
        return Scenario(
            self.whole_seed,
            tuple(self._prepared(index, craft) for index, craft in enumerate(self.crafts)),
            tuple(sorted(self.events, key=lambda event: event.time_s)),
            posts,
            (round(wind * math.cos(angle), 2), round(wind * math.sin(angle), 2), 0.0),
            round(rng.uniform(0.0, 1.5), 2) if wind else 0.0,
        )

    def _craft(self, home: tuple[float, float, float], index: int) -> Craft:
        rng = self.rng
        kind, autopilot = rng.choice(_CRAFTS)
        server = {name: rng.choice(values) for name, values in _SERVER if rng.random() < 0.12}
        if rng.random() < 0.4:
            server["on_station_pause"] = "pause"
        if kind == "plane":
            server["volume_radius_m"] = 3000.0
            server.pop("volume_altitude_max_m", None)
        if server.get("speed_default_m_s", 3.0) > server.get("speed_max_m_s", 10.0):
            server.pop("speed_max_m_s")
        place = (home[0] + index * 3e-4, home[1], home[2])
        battery = rng.choice((1.0, 1.0, 1.0, 0.6, 0.3)) if rng.random() < 0.4 else 1.0
        search_s = rng.choice((0.0, 0.0, 0.1, 0.4, 1.5))
        specs = _ONBOARD.get((kind, autopilot), ())
        onboard = {name: rng.choice(values) for name, values in specs if rng.random() < 0.12}
        if "FENCE_RADIUS" in onboard:
            onboard["FENCE_ENABLE"] = 1.0
        signed, chatty = rng.random() < 0.1, rng.random() < 0.25
        return Craft(kind, autopilot, place, battery, onboard, server, search_s, signed, chatty)

    def _prepared(self, index: int, craft: Craft) -> Craft:
        """Return a craft that lands on marks where it is asked to."""
        if craft.autopilot == "px4" or not any(
            event.craft == index and "mark" in event.how for event in self.events
        ):
            return craft
        return replace(craft, onboard={**craft.onboard, **_LANDS_ON_TARGETS})

    def _posts(self) -> tuple[Post, ...]:
        rng = self.rng
        made = []
        for _ in range(rng.randrange(3, 25)):
            at = (round(rng.uniform(-30.0, 30.0), 1), round(rng.uniform(-30.0, 30.0), 1))
            if math.hypot(*at) > 6.0:
                made.append(Post(at, round(rng.uniform(0.2, 2.0), 1), 20.0))
        return tuple(made)

    def _add(self, time_s: float, craft: int, what: str, **how: Any) -> None:
        self.events.append(Event(round(time_s, 2), craft, what, how))

    def _place(self, craft: int) -> list[float]:
        rng, kind = self.rng, self.crafts[craft].kind
        reach_m = 700.0 if kind == "plane" else rng.choice((4.0, 15.0, 15.0, 30.0, 30.0, 90.0))
        height = {"copter": rng.uniform(1.0, 12.0), "plane": rng.uniform(50.0, 100.0)}.get(
            kind, 0.0
        )
        return [round(rng.uniform(-reach_m, reach_m), 1) for _ in range(2)] + [round(height, 1)]

    def _people(self, craft: int, posts: bool) -> None:
        rng = self.rng
        t = rng.uniform(0.0, 3.0)
        if self.crafts[craft].server.get("arming") == "never":
            self._add(t, craft, "serve", service="arm", mode="")
        while t < self.last_s:
            self._ask(t, craft, posts)
            if rng.random() < 0.15:
                self._ask_away_from_home(t + rng.uniform(15.0, 50.0), craft)
            if rng.random() < 0.3:
                self._add(t + rng.expovariate(1 / 12.0), craft, "cancel")
            if rng.random() < 0.2:
                begun = t + rng.expovariate(1 / 8.0)
                self._add(begun, craft, "pause")
                self._add(begun + rng.uniform(0.0, 20.0), craft, "resume")
            if rng.random() < 0.08:
                service = rng.choice(("hold", "arm", "disarm", "set_mode"))
                mode = rng.choice(_PILOT_MODES[self._kind(craft)]) if service == "set_mode" else ""
                self._add(t + rng.uniform(0.0, 20.0), craft, "serve", service=service, mode=mode)
            t += rng.choice((0.05, 3.0, 15.0, 40.0, 60.0)) * rng.uniform(0.5, 1.5)

    def _kind(self, craft: int) -> tuple[str, str]:
        return self.crafts[craft].kind, self.crafts[craft].autopilot

    def _ask_away_from_home(self, t: float, craft: int) -> None:
        rng = self.rng
        what = rng.choice(("navigate", "go_home", "land"))
        if what == "navigate":
            place = [round(rng.uniform(-8.0, 8.0), 1), round(rng.uniform(-8.0, 8.0), 1), 0.5]
            self._add(t, craft, what, place=place, frame="base_link")
        elif what == "land":
            self._add(t, craft, what, **self._mark(t, craft))
        else:
            self._add(t, craft, what)

    def _ask(self, t: float, craft: int, posts: bool) -> None:
        rng = self.rng
        draw = rng.random()
        avoid = posts and rng.random() < 0.8
        speed = rng.choice((0.0, 0.0, 0.5, 2.0, 6.0)) if self.crafts[craft].kind != "plane" else 0.0
        if draw < 0.06:
            self._ask_round(t, craft, speed, avoid)
        elif draw < 0.09 and self.crafts[craft].kind == "plane":
            self._steer_plane(t, craft)
        elif draw < 0.09:
            self._ask_beside(t, craft, speed)
        elif draw < 0.45:
            self._add(t, craft, "navigate", place=self._place(craft), speed=speed, avoid=avoid)
        elif draw < 0.52:
            place = self._place(craft)
            place[rng.randrange(3)] = rng.choice(_BAD_NUMBERS)
            frame = rng.choice(("map", "wgs84", "moon"))
            self._add(t, craft, "navigate", place=place, frame=frame)
        elif draw < 0.57:
            place = [rng.uniform(-8.0, 8.0), rng.uniform(-8.0, 8.0), rng.uniform(-1.0, 2.0)]
            self._add(t, craft, "navigate", place=place, frame="base_link")
        elif draw < 0.82:
            places = [self._place(craft) for _ in range(rng.randrange(1, 5))]
            mission = rng.random() < 0.4
            self._add(
                t, craft, "route", places=places, speed=speed, mission=mission,
                hold_s=rng.choice((0.0, 0.0, 2.0)), laps=rng.choice((0, 0, 2)),
                avoid=avoid and not mission, acts=_acts(places),
                **_turning(places),
            )  # fmt: skip
        elif draw < 0.88:
            self._add(t, craft, "takeoff", height=rng.choice((0.0, 2.0, 5.0)))
        elif draw < 0.94:
            self._add(t, craft, "land", **self._mark(t, craft))
        else:
            self._add(t, craft, "go_home")

    def _ask_round(self, t: float, craft: int, speed: float, avoid: bool) -> None:
        """A circle, with an end: after the last event every goal has to end."""
        rng = self.rng
        radius = rng.choice((2.0, 5.0, 5.0, 12.0)) * rng.choice((-1.0, 1.0))
        if self.crafts[craft].kind == "plane":
            radius *= 20.0
        laps = rng.choice((0.3, 1.0, 1.0, 2.5))
        if rng.random() < 0.1:
            radius, laps = rng.choice(((0.0, 1.0), (math.nan, 1.0), (0.3, 1.0), (5.0, -1.0)))
        x, y, height = self._place(craft)
        if rng.random() < 0.3:
            height = math.nan
        self._add(
            t, craft, "orbit", centre=[x, y], radius=radius, laps=laps,
            height=height, speed=max(speed, 2.0) if speed else 0.0,
            yaw=rng.choice(("CENTRE", "TANGENT", "KEEP")), avoid=avoid,
        )  # fmt: skip

    def _ask_beside(self, t: float, craft: int, speed: float) -> None:
        """A target that moves, stands, comes at the vehicle, is lost or lies."""
        rng = self.rng
        velocity = [rng.uniform(-3.0, 3.0), rng.uniform(-3.0, 3.0), 0.0]
        bearing_rad, away_m = rng.uniform(-math.pi, math.pi), rng.choice((1.0, 5.0, 8.0, 15.0))
        offset = [away_m * math.cos(bearing_rad), away_m * math.sin(bearing_rad), 0.0]
        if rng.random() < 0.1:
            offset[rng.randrange(3)] = rng.choice(_BAD_NUMBERS)
        start, least = self._place(craft), rng.choice((0.0, 2.0, 4.0))
        below = random.Random(f"below {self.seed} {craft} {t}")
        if self.crafts[craft].kind == "copter" and below.random() < 0.25:
            # A place that would be in the ground, and is moved up towards the target.
            start = [0.2 * start[0], 0.2 * start[1], below.choice((3.0, 4.5))]
            velocity, offset, least = [0.0, 0.0, 0.0], [0.5, 0.0, -5.0], 4.0
        self._add(
            t, craft, "follow", start=start, velocity=velocity, offset=offset,
            least=least, speed=speed, duration=rng.choice((10.0, 30.0)),
            stands_s=rng.choice((0.0, 5.0, 20.0)), lost_s=rng.choice((3.0, 12.0, 99.0)),
            lie=rng.choice(("", "", "", "", "nan", "old", "far")),
            yaw=rng.choice(("TARGET", "TANGENT", "KEEP")),
        )  # fmt: skip

    def _steer_plane(self, t: float, craft: int) -> None:
        """A course, a climb and an airspeed, also such as no plane flies."""
        rng = self.rng
        course_rad, speed = rng.uniform(-math.pi, math.pi), rng.choice((18.0, 20.0, 20.0, 25.0))
        linear = [speed * math.cos(course_rad), speed * math.sin(course_rad), rng.uniform(-4, 4)]
        frame = rng.choice(("map", "map", "base_link"))
        if frame == "base_link":
            linear = [rng.choice((20.0, 20.0, 3.0, -20.0)), 0.0, linear[2]]
        if rng.random() < 0.1:
            linear[rng.randrange(3)] = rng.choice(_BAD_NUMBERS)
        self._add(
            t, craft, "steer", linear=linear, rate=rng.choice((0.0, 0.0, 0.1, -0.4)),
            seconds=rng.choice((10.0, 40.0, 120.0)), frame=frame,
        )  # fmt: skip

    def _mark(self, t: float, craft: int) -> dict[str, Any]:
        """The mark of two landings in three of a copter, without a draw, as `_acts`.

        It may be seen never or only from above, or tell where it is, as a boat does; it vanishes,
        jumps, perhaps when it is too late to land on it, or lies.
        """
        rng = random.Random(f"mark {self.seed} {craft} {t}")
        if self.crafts[craft].kind != "copter" or rng.random() < 0.33:
            return {}
        return {
            "mark": [round(rng.uniform(-3.0, 3.0), 1), round(rng.uniform(-3.0, 3.0), 1)],
            "required": rng.random() < 0.7,
            "retries": rng.choice((0, 0, 1, 2)),
            "search": rng.choice((0.0, 0.0, 6.0, 12.0, rng.choice(_BAD_NUMBERS))),
            "covered_below": rng.choice((0.0, 0.0, 0.5, 2.5)),
            "fault": rng.choice(("", "", "vanishes", "vanishes", "jumps", "nan", "old", "far")),
            "fault_s": rng.choice((0.0, 2.0, 5.0, 9.0, 14.0)),
            "jump": rng.choice((-3.0, 1.5, 4.0)),
            "told": rng.random() < 0.3,
            "jump_below": rng.choice((0.0, 0.6, 0.9)),
        }

    def _stations(self, craft: int) -> None:
        rng = self.rng
        modes = _PILOT_MODES[self._kind(craft)]
        for _ in range(rng.choice((0, 1, 1, 2, 4))):
            t, seen = rng.uniform(2.0, self.last_s), rng.random() < 0.6
            what = rng.choice(
                ("station_mode", "station_mode", "pilot_mode", "station_pause", "station_clear",
                 "station_upload", "station_goto", "station_current", "station_arm")
            )  # fmt: skip
            if what == "pilot_mode":
                self._add(t, craft, what, mode=rng.choice(modes))
            elif what == "station_mode":
                signed = rng.random() < 0.8
                self._add(t, craft, what, mode=rng.choice(modes), seen=seen, signed=signed)
            elif what == "station_pause":
                self._add(t, craft, what, go_on=False, seen=seen)
                self._add(t + rng.uniform(1.0, 20.0), craft, what, go_on=True, seen=seen)
            elif what == "station_upload":
                self._add(t, craft, what, count=rng.randrange(1, 6), seen=seen)
            elif what == "station_goto":
                self._add(t, craft, what, north_m=rng.uniform(-20, 20), height_m=10.0, seen=seen)
            elif what == "station_current":
                self._add(t, craft, what, seq=rng.randrange(4), seen=seen)
            elif what == "station_arm":
                self._add(t, craft, what, arm=rng.random() < 0.5, seen=seen)
            else:
                self._add(t, craft, what, seen=seen)

    def _settings(self, craft: int) -> None:
        """Parameters and home set in flight, in one scenario of three, without a draw."""
        rng = random.Random(f"settings {self.seed} {craft}")
        if rng.random() > 0.33:
            return
        specs = _SET_IN_FLIGHT.get(self._kind(craft), ())
        for _ in range(rng.choice((1, 2, 4))):
            t, seen = rng.uniform(2.0, self.last_s), rng.random() < 0.6
            if specs and rng.random() < 0.8:
                name, values = rng.choice(specs)
                self._add(t, craft, "station_param", name=name, value=rng.choice(values), seen=seen)
            else:
                offset = [round(rng.uniform(-60.0, 60.0), 1) for _ in range(2)]
                offset.append(rng.choice((0.0, 0.0, -20.0, 30.0)))
                self._add(t, craft, "station_home", offset=offset, seen=seen)

    def _pilot(self, craft: int) -> None:
        """A PX4's pilot with sticks, in two scenarios of five, without a draw."""
        rng = random.Random(f"pilot {self.seed} {craft}")
        held = self.crafts[craft]
        if held.autopilot != "px4" or rng.random() > 0.4:
            return
        onboard = dict(held.onboard)
        if held.kind == "copter" and rng.random() < 0.5:
            onboard["COM_RC_OVERRIDE"] = 3.0
        self.crafts[craft] = replace(held, onboard=onboard, sticks=True)
        moves = rng.choice((0, 1, 2)) if self.mood in ("stations", "all") else 0
        for _ in range(moves):
            begun_s = rng.uniform(2.0, self.last_s)
            self._add(begun_s, craft, "pilot_stick", forward=rng.choice((-0.6, 0.02, 0.6, 1.0)))
            self._add(begun_s + rng.uniform(0.2, 5.0), craft, "pilot_stick", forward=0.0)
        if self.mood in ("trouble", "all") and rng.random() < 0.4:
            begun_s = rng.uniform(0.0, self.last_s)
            self._add(begun_s, craft, "radio", lost=True)
            lasts_s = rng.choice((0.3, 3.0, 30.0)) * rng.uniform(0.5, 1.5)
            self._add(begun_s + lasts_s, craft, "radio", lost=False)

    def _release(self, craft: int) -> None:
        """Another release of the firmware for one vehicle in two, without a draw."""
        rng = random.Random(f"release {self.seed} {craft}")
        if rng.random() < 0.5:
            held = self.crafts[craft]
            firmware = rng.choice(RELEASES[held.autopilot])
            self.crafts[craft] = replace(held, firmware=firmware)

    def _trajectories(self, craft: int) -> None:
        """Trajectories of a planner for one copter in four, without a draw."""
        rng = random.Random(f"trajectories {self.seed} {craft}")
        if self.crafts[craft].kind != "copter" or rng.random() > 0.25:
            return
        begun_s = rng.uniform(0.0, 0.8) * self.last_s
        self._add(begun_s, craft, "trajectory", points=_curve(rng))
        for number in range(rng.choice((0, 1, 4))):
            t = begun_s + 2.0 * (number + rng.random())
            self._add(t, craft, "trajectory", points=_curve(rng), topic=True)

    def _payload(self, craft: int) -> None:
        """A camera, a gimbal or both for one vehicle in four, without a draw, and what uses them.

        A vehicle that has neither gets requests, too, in one scenario of ten.
        """
        rng = random.Random(f"payload {self.seed} {craft}")
        draw = rng.random()
        if draw > 0.35:
            return
        if draw < 0.25:
            camera, gimbal = rng.choice(((True, False), (False, True), (True, True), (True, True)))
            self.crafts[craft] = replace(self.crafts[craft], camera=camera, gimbal=gimbal)
            self.events = [_with_looks(event, craft, rng) for event in self.events]
        for _ in range(rng.choice((1, 3, 6))):
            t = rng.uniform(0.0, self.last_s)
            if rng.random() < 0.4:
                self._add(t, craft, "photo")
                continue
            how: dict[str, Any] = {"mode": rng.choice(("ANGLE", "ANGLE", "POINT", "NONE"))}
            if how["mode"] == "ANGLE":
                how["pitch"] = rng.choice((-math.pi / 2, -0.5, 0.0, 0.3, 1.4, rng.uniform(-2, 2)))
                how["yaw"], how["locked"] = rng.uniform(-7.0, 7.0), rng.random() < 0.4
                if rng.random() < 0.1:
                    how[rng.choice(("pitch", "yaw"))] = rng.choice(_BAD_NUMBERS)
            elif how["mode"] == "POINT":
                how["target"] = [round(rng.uniform(-50.0, 50.0), 1) for _ in range(3)]
                how["frame"] = rng.choice(("map", "map", "base_link", "wgs84", "moon"))
                if rng.random() < 0.1:
                    how["target"][rng.randrange(3)] = rng.choice(_BAD_NUMBERS)
            self._add(t, craft, "point", **how)

    def _unsafe(self, craft: int) -> None:
        """Soon after each goal is asked for: settings, another mission or home, flicked modes."""
        rng = random.Random(f"unsafe {self.seed} {craft}")
        specs = _UNSAFE_SETTINGS.get(self._kind(craft), ())
        modes = _PILOT_MODES[self._kind(craft)]
        asked = [e for e in self.events if e.craft == craft and e.what in _GOALS]
        for goal in asked[:6]:
            t, seen = goal.time_s + rng.choice((0.05, 0.3, 1.0, 4.0, 12.0)), rng.random() < 0.6
            draw = rng.random()
            if draw < 0.5 and specs:
                name, values = rng.choice(specs)
                self._add(t, craft, "station_param", name=name, value=rng.choice(values), seen=seen)
            elif draw < 0.65:
                offset = [round(rng.uniform(-60.0, 60.0), 1) for _ in range(2)]
                self._add(t, craft, "station_home", offset=[*offset, 0.0], seen=seen)
            elif draw < 0.8:
                self._add(t, craft, "station_upload", count=rng.randrange(1, 6), seen=seen)
            else:
                flicked, back = rng.choice(modes), rng.choice(modes)
                self._add(t, craft, "pilot_mode", mode=flicked)
                self._add(t + rng.choice((0.05, 0.3, 1.2)), craft, "pilot_mode", mode=back)

    def _lies(self, craft: int) -> None:
        """Frames with the vehicle's ids: a stream, slower or faster than its own, or single ones.

        A second one may begin as the first has ended, and goals are asked for meanwhile.
        """
        rng = random.Random(f"lies {self.seed} {craft}")
        at_s = rng.uniform(0.0, 25.0)
        for _ in range(rng.choice((1, 2, 3))):
            claim, period_s = rng.choice(tuple(LIES)), rng.choice((0.0, 0.05, 0.2, 0.7, 2.0, 5.0))
            self._add(at_s, craft, "lie", claim=claim, period=period_s)
            lasts_s = rng.uniform(5.0, 40.0)
            if rng.random() < 0.7:
                self._add(at_s + 0.8 * lasts_s, craft, rng.choice(("land", "go_home", "takeoff")))
            at_s += lasts_s
            self._add(at_s, craft, "lie")
            at_s += rng.uniform(0.0, 20.0)

    def _trouble(self, craft: int) -> None:
        rng = self.rng
        for _ in range(rng.choice((0, 1, 1, 2, 3))):
            t = rng.uniform(0.0, self.last_s)
            last = t + rng.choice((0.3, 2.0, 6.0, 15.0, 40.0)) * rng.uniform(0.5, 1.5)
            if rng.random() < 0.65:
                self._trouble_that_passes(craft, t, last)
            else:
                self._trouble_at_once(craft, t)

    def _trouble_that_passes(self, craft: int, t: float, last: float) -> None:
        rng = self.rng
        what = rng.choice(
            ("link", "link", "silence", "gps", "glitch", "radio", "kill", "shut_down", "stuck",
             "full", "blind")
        )  # fmt: skip
        if what == "link":
            faults = {
                "loss": rng.choice((0.0, 0.1, 0.3)), "duplicate": rng.choice((0.0, 0.3)),
                "delay_s": rng.choice((0.0, 0.1, 0.6)), "jitter_s": rng.choice((0.0, 0.3)),
                "corrupt": rng.choice((0.0, 0.1)),
            }  # fmt: skip
            self._add(t, craft, what, **faults)
            self._add(last, craft, what)
        elif what == "silence":
            mute = rng.random() < 0.3
            self._add(t, craft, what, on=True, mute=mute)
            self._add(last, craft, what, on=False, mute=mute)
        elif what in ("gps", "radio"):
            self._add(t, craft, what, lost=True)
            self._add(last, craft, what, lost=False)
        elif what in ("stuck", "full", "blind"):
            self._add(t, craft, what, on=True)
            self._add(last, craft, what, on=False)
        elif what == "glitch":
            offset = [round(rng.uniform(-60, 60), 1), round(rng.uniform(-60, 60), 1), 0.0]
            self._add(t, craft, what, offset=offset)
            if rng.random() < 0.7:
                self._add(last, craft, what, offset=[0.0, 0.0, 0.0])
        else:
            self._add(t, craft, what)
            if what == "shut_down":
                self._add(t + 15.0, craft, "kill")
            begun = max(last, t + 15.5)
            self._add(begun, craft, "start")
            if rng.random() < 0.5:
                self._ask(begun + rng.choice((0.0, 0.3, 3.0)), craft, False)

    def _trouble_at_once(self, craft: int, t: float) -> None:
        rng = self.rng
        what = rng.choice(
            ("battery", "wind", "reboot", "stall", "stall", "stall", "noise", "clock")
        )
        if what == "battery":
            self._add(t, craft, what, share=rng.choice((0.05, 0.15, 0.4)))
        elif what == "wind":
            velocity = [round(rng.uniform(-6, 6), 1), round(rng.uniform(-6, 6), 1), 0.0]
            self._add(t, craft, what, velocity=velocity)
        elif what == "stall":
            self._add(t, craft, what, seconds=round(rng.choice((0.3, 1.0, 4.0, 20.0)), 2))
        elif what == "clock":
            self._add(t, craft, what, seconds=rng.choice((-3600.0, -2.0, 5.0, 86400.0)))
        elif what == "noise":
            self._add(t, craft, what, seed=rng.randrange(1000), count=rng.randrange(1, 40))
        else:
            self._add(t, craft, what)


class _TrafficAuthor:
    """Writes one scenario of copters that share traffic, each with its server, which hangs.

    They change places, and return. Their servers stand still for a while meanwhile, or are killed.
    """

    def __init__(self, seed: int) -> None:
        self._lying = bool(seed & LYING)
        self._whole_seed, seed = seed, seed & ~(LYING | UNSAFE)
        self._seed = seed
        self._rng = random.Random(seed)
        self._events: list[Event] = []

    def write(self) -> Scenario:
        rng = self._rng
        count, autopilot = rng.choice((2, 3, 3)), rng.choice(("ardupilot", "ardupilot", "px4"))
        quick = autopilot == "ardupilot" and rng.random() < 0.5
        onboard = {"GUID_TIMEOUT": 1.0} if quick else {}
        latitude, longitude, altitude = rng.choice(_HOMES)
        east_deg = 1.0 / (_METRES_PER_DEGREE * math.cos(math.radians(latitude)))
        crafts = []
        for east, north in _SHARED_PLACES_M[:count]:
            place = (latitude + north / _METRES_PER_DEGREE, longitude + east * east_deg, altitude)
            crafts.append(Craft("copter", autopilot, place, onboard=onboard))
        height_m = rng.choice((4.0, 5.0, 8.0))
        swap = _SWAPS[0] if count == 2 else rng.choice(_SWAPS)
        swap_s = rng.uniform(15.0, 30.0)
        return_s = swap_s + rng.choice((10.0, 30.0, 60.0))
        for craft in range(count):
            self._go(rng.uniform(0.0, 2.0), craft, craft, height_m)
            self._go(swap_s + rng.choice((0.0, 0.0, 0.5)), craft, swap[craft], height_m)
            if rng.random() < 0.2:
                begun_s = swap_s + rng.uniform(0.0, 20.0)
                self._add(begun_s, craft, "pause")
                self._add(begun_s + rng.uniform(1.0, 15.0), craft, "resume")
            self._add(return_s + rng.choice((0.0, 0.0, 0.5)), craft, "go_home")
            self._hang(craft, rng.choice((0.0, swap_s)), return_s + 10.0)
        if self._lying:
            self._misreports(count, return_s + 20.0)
            self._aircraft(count, return_s + 20.0)
        events = tuple(sorted(self._events, key=lambda event: event.time_s))
        return Scenario(self._whole_seed, tuple(crafts), events, shares_traffic=True)

    def _add(self, time_s: float, craft: int, what: str, **how: Any) -> None:
        self._events.append(Event(round(time_s, 2), craft, what, how))

    def _go(self, time_s: float, craft: int, place: int, height_m: float) -> None:
        """Send a vehicle to where one stood at first; its map begins where it stood itself."""
        (east, north), (x, y) = _SHARED_PLACES_M[place], _SHARED_PLACES_M[craft]
        self._add(time_s, craft, "navigate", place=[east - x, north - y, height_m])

    def _misreports(self, count: int, last_s: float) -> None:
        """Let the last server report to the others, for a while, what is not so."""
        rng = random.Random(f"misreports {self._seed}")
        begun_s = rng.uniform(0.0, last_s)
        self._add(begun_s, count - 1, "misreport", claim=rng.choice(MISREPORTS))
        self._add(rng.uniform(begun_s, last_s), count - 1, "misreport")

    def _aircraft(self, count: int, last_s: float) -> None:
        """Let receivers of half of the vehicles pass on aircraft that cannot be, for a while."""
        rng = random.Random(f"aircraft {self._seed}")
        for craft in range(count):
            if rng.random() < 0.5:
                begun_s, claim = rng.uniform(0.0, last_s), rng.choice(AIRCRAFT)
                self._add(begun_s, craft, "aircraft", claim=claim, seed=rng.randrange(1000))
                self._add(begun_s + rng.uniform(5.0, 40.0), craft, "aircraft")

    def _hang(self, craft: int, time_s: float, last_s: float) -> None:
        """Let a server stand still again and again, or be killed and started once."""
        rng = self._rng
        if rng.random() < 0.15:
            begun_s = rng.uniform(time_s, last_s)
            self._add(begun_s, craft, "kill")
            started_s = begun_s + rng.uniform(1.0, 12.0)
            self._add(started_s, craft, "start")
            # Otherwise it stays where another has to land, which waits for it without end.
            self._add(max(started_s, last_s) + 5.0, craft, "go_home")
            return
        longest_s = rng.choice((0.3, 1.0, 3.0, 10.0))
        while (time_s := time_s + rng.expovariate(1.0 / 6.0)) < last_s:
            seconds = round(rng.uniform(0.1, longest_s), 2)
            self._add(time_s, craft, "stall", seconds=seconds)
            time_s += seconds


def scenario_of(seed: int) -> Scenario:
    """Make a scenario; the same number gives the same one."""
    if seed >= MORE_SITUATIONS_FROM:
        return write_more(seed)
    if seed >= SITUATIONS_FROM:
        return write_situation(seed)
    if seed >= SHARING_FROM:
        return _TrafficAuthor(seed).write()
    return _Author(seed).write()


def _acts(places: list[list[float]]) -> list[str]:
    """Acts of one route in four, without a draw: the rest of a scenario is as without them."""
    rng = random.Random(repr(places))
    if rng.random() < 0.75:
        return []
    names = (
        "in use",
        "servo",
        "servo",
        "servo",
        "trigger",
        "wait",
        "wait",
        "photo",
        "needed",
        "bad",
    )
    return [rng.choice(names[: rng.choice((7, 7, 10))]) for _ in range(rng.choice((1, 2, 3)))]


def _with_looks(event: Event, craft: int, rng: random.Random) -> Event:
    """Return an event; a route of this vehicle may use its gimbal and its camera."""
    if event.craft != craft or event.what != "route" or rng.random() < 0.3:
        return event
    names = ("look", "look at", "look north", "look ahead", "photo", "trigger", "wait", "grip")
    acts = [rng.choice(names) for _ in range(rng.choice((1, 2, 4)))]
    return replace(event, how={**event.how, "acts": acts})


def _turning(places: list[list[float]]) -> dict[str, float]:
    """The yaw rate of one route in six, without a draw, as `_acts`."""
    rng = random.Random(f"yaw {places!r}")
    if rng.random() > 1 / 6:
        return {}
    return {"yaw_rate": rng.choice((-1.0, -0.3, 0.2, 0.5, 1.2, rng.choice((math.nan, 60.0))))}


def _curve(rng: random.Random) -> list[list[float]]:
    """Return points of a trajectory from the vehicle on; one in five has a fault."""
    speed_m_s, course = rng.choice((0.5, 1.5, 3.0, 12.0)), rng.uniform(-math.pi, math.pi)
    bend, climb_m_s = rng.uniform(-0.3, 0.3), rng.uniform(-0.5, 0.5)
    with_velocity, step_s = rng.random() < 0.7, rng.choice((0.2, 1.0, 3.0))
    points, place = [], [0.0, 0.0, 0.0]
    for number in range(rng.choice((2, 10, 40))):
        heading = course + bend * number * step_s
        velocity = [speed_m_s * math.cos(heading), speed_m_s * math.sin(heading), climb_m_s]
        point = [number * step_s, *place, *(velocity if with_velocity else ())]
        points.append([round(value, 3) for value in point])
        place = [a + step_s * b for a, b in zip(place, velocity, strict=True)]
    if rng.random() < 0.2:
        row, column = rng.randrange(len(points)), rng.randrange(4)
        points[row][column] = rng.choice((math.nan, math.inf, -1.0, 1e9, 50.0))
    return points
