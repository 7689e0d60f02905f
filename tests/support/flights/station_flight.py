"""A bridge with a ground station beside it: both speak to one simulated vehicle."""

from __future__ import annotations

import math

from mavlink_sitl import VehicleConfig
from mavlink_vehicle.codec import Codec, Message, make, mavlink
from mavlink_vehicle.mission_items import MissionItem
from mavlink_vehicle.profiles import ModePacking
from navigation_bridge.goals.requests import Request, WaypointRequest, WaypointsRequest
from navigation_core.geometry import Vector3
from tests.support.flights.simulated_flight import SimulatedFlight

STATION = (255, 190)
TARGET = {"target_system": 1, "target_component": 1}
_INT32_MAX = 2**31 - 1


class StationFlight(SimulatedFlight):
    """Adds a station whose messages pass the server, or don't, on their way to the vehicle."""

    def __init__(self, autopilot: str, vehicle: str, **parameters: object) -> None:
        # A PX4 plane wants a landing in every mission, which a route does not have.
        own = {"MIS_TKO_LAND_REQ": 0.0} if (autopilot, vehicle) == ("px4", "plane") else {}
        super().__init__(
            simulated=VehicleConfig(
                autopilot=autopilot, vehicle=vehicle, ready_after_s=1.0, parameters=own
            ),
            volume_radius_m=3000.0,
            battery_policy="ignore",
            **parameters,  # type: ignore[arg-type]
        )
        self._station = Codec(*STATION)
        self.ready()

    @property
    def hovers(self) -> bool:
        return self.kind != "plane"

    # --- goals ---------------------------------------------------------------------------

    def far(self, far_m: float) -> Vector3:
        """A place that it is on its way to for a while: so far off, for a plane further."""
        here = self.bridge.pose
        assert here is not None
        x, y, _ = here.position_enu_m
        if not self.hovers:
            return (x, 900.0 if y < 0.0 else -900.0, 70.0)
        return (x, y + (far_m if y < 15.0 else -far_m), 4.0 if self.kind == "copter" else 0.0)

    def goal(self, place: Vector3, by_mission: bool) -> Request:
        """A goal to one place."""
        if not by_mission:
            return self.request(*place, speed=3.0 if self.hovers else 0.0)
        waypoint = WaypointRequest(place, acceptance_radius_m=2.0 if self.hovers else 60.0)
        return WaypointsRequest((waypoint,), by_mission=True)

    def begin(self, by_mission: bool, far_m: float = 30.0) -> str:
        """Start a goal to a place far off; it is under way when this returns."""
        goal_id = self.start(self.goal(self.far(far_m), by_mission))
        self.run_until(lambda: self.status(goal_id) == "NAVIGATING", 120.0)
        self.run_for(2.0)
        assert self.status(goal_id) == "NAVIGATING", self.outputs[-3:]
        return goal_id

    # --- what the station does -------------------------------------------------------------

    def tell(self, *messages: Message, seen: bool = True, heard_late_s: float = 0.0) -> None:
        """Send as the station does; late: the vehicle has it before the server sees it."""
        for message in messages:
            data = self._station.encode(message)
            (parsed,) = Codec(1, 1).decode(data)
            if seen and heard_late_s == 0.0:
                self.bridge.overhear(parsed, self.now)
                self._collect()
            self.simulation.link.write(data)
            if seen and heard_late_s > 0.0:
                self.run_for(heard_late_s)
                self.bridge.overhear(parsed, self.now)
                self._collect()

    def clear(self, **how: object) -> None:
        """MISSION_CLEAR_ALL."""
        self.tell(make("MISSION_CLEAR_ALL", **TARGET), **how)  # type: ignore[arg-type]

    def upload(self, count: int, **how: object) -> None:
        """Store another mission: waypoints to the North of home."""
        items = [
            MissionItem(
                mavlink.MAV_CMD_NAV_WAYPOINT,
                mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
                (0.0, 0.0, 0.0, math.nan),
                -353632620 + 100 * index,
                1491652370,
                30.0,
            )
            for index in range(count)
        ]
        self.tell(make("MISSION_COUNT", **TARGET, count=count), **how)  # type: ignore[arg-type]
        for seq, item in enumerate(items):
            self.run_for(0.2)
            self.tell(
                make(
                    "MISSION_ITEM_INT", **TARGET, seq=seq, frame=item.frame, command=item.command,
                    autocontinue=1, param4=0.0, x=item.x, y=item.y, z=item.z,
                ),
                **how,  # type: ignore[arg-type]
            )  # fmt: skip
        self.run_for(0.2)

    def pause_or_continue(self, go_on: bool, **how: object) -> None:
        """DO_PAUSE_CONTINUE."""
        self.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, float(go_on), **how)

    def reposition_nowhere(self, **how: object) -> None:
        """DO_REPOSITION without a position."""
        command = mavlink.MAV_CMD_DO_REPOSITION
        profile = self.vehicle.profile
        assert profile is not None
        if profile.mode_packing is ModePacking.MAIN_AND_SUB:
            nan = math.nan
            self.command(command, -1.0, 1.0, 0.0, nan, nan, nan, nan, **how)
            return
        message = make(
            "COMMAND_INT", **TARGET, frame=6, command=command, param1=-1.0, param2=1.0,
            x=_INT32_MAX, y=_INT32_MAX, z=math.nan,
        )  # fmt: skip
        self.tell(message, **how)  # type: ignore[arg-type]

    def reposition(self, latitude_deg: float, longitude_deg: float, amsl_m: float) -> None:
        """DO_REPOSITION to a position, with the change of mode."""
        message = make(
            "COMMAND_INT", **TARGET, frame=0, command=mavlink.MAV_CMD_DO_REPOSITION, param1=-1.0,
            param2=1.0, x=round(latitude_deg * 1e7), y=round(longitude_deg * 1e7), z=amsl_m,
        )  # fmt: skip
        self.tell(message)

    def mode(self, name: str | None, **how: object) -> None:
        """DO_SET_MODE by name."""
        profile = self.vehicle.profile
        assert profile is not None
        assert name is not None
        number = profile.modes[name]
        if profile.mode_packing is ModePacking.MAIN_AND_SUB:
            parts = (1.0, float(number >> 16 & 0xFF), float(number >> 24))
        else:
            parts = (1.0, float(number), 0.0)
        self.command(mavlink.MAV_CMD_DO_SET_MODE, *parts, **how)

    def hold_mode(self, **how: object) -> None:
        """The mode that holds by itself."""
        assert self.vehicle.profile is not None
        self.mode(self.vehicle.profile.hold_mode, **how)

    def working_mode(self, **how: object) -> None:
        """The mode in which the server flies it, or in which it flies the mission."""
        profile = self.vehicle.profile
        assert profile is not None
        self.mode(profile.mission_mode if self.stored else profile.control_mode, **how)

    def command(self, command: int, *params: float, **how: object) -> None:
        """COMMAND_LONG."""
        values = {f"param{place}": value for place, value in enumerate(params, start=1)}
        message = make("COMMAND_LONG", **TARGET, command=command, **values)
        self.tell(message, **how)  # type: ignore[arg-type]

    # --- what was seen -----------------------------------------------------------------------

    def modes_asked(self, since_s: float) -> list[int]:
        """Return the modes that the server asked for since a time, by DO_SET_MODE's param2/3."""
        assert self.vehicle.profile is not None
        packed = self.vehicle.profile.mode_packing is ModePacking.MAIN_AND_SUB
        found = []
        for time_s, message in self.sent:
            if time_s < since_s or message.get_type() != "COMMAND_LONG":
                continue
            if message.command != mavlink.MAV_CMD_DO_SET_MODE:
                continue
            mode = int(message.param2)
            found.append(mode << 16 | int(message.param3) << 24 if packed else mode)
        return found

    @property
    def stored(self) -> int:
        """How many items the vehicle says it has stored."""
        mission = self.vehicle.state.mission
        return 0 if mission is None or mission.total is None else mission.total
