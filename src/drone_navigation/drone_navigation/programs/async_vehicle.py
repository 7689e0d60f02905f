"""A vehicle for programs with an event loop."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence
from functools import partial
from types import TracebackType
from typing import Any, TypeVar

from std_srvs.srv import Trigger

from custom_interfaces.srv import GetVehicleParameter, SetMode, SetVehicleParameter
from drone_navigation.client.client_goal import ClientGoal
from drone_navigation.programs import goal_messages as goals
from drone_navigation.programs.errors import NO_SERVER, REQUEST_REJECTED, NavigationError
from drone_navigation.programs.flown_goal import FlownGoal
from drone_navigation.programs.reported_state import ReportedState
from drone_navigation.programs.server_link import ServerLink
from drone_navigation.programs.steering import Steering
from navigation_bridge.names import FRAME_MAP
from navigation_core.geometry import Vector3

__all__ = ["AsyncVehicle"]

_Goal = TypeVar("_Goal", bound=FlownGoal)
_PERIOD_S = 0.05


class AsyncVehicle:
    """A vehicle of a navigation server, used with ``async with``.

    Each goal is a `FlownGoal`, sent at once: ``await`` it for its end, or iterate it for its
    feedback. A later one replaces it. Positions are metres east, north and up from the map origin.
    At the end of the ``async with`` block, by Ctrl-C or an exception, too, goals that are still
    flown are cancelled. All methods raise a `NavigationError` for what is not done.

    Attributes:
        origin: the program's name for itself, for the goals to come; empty for none.
    """

    def __init__(self, name: str = "", timeout_s: float = 10.0, origin: str = "") -> None:
        """Prepare.

        Args:
            name: namespace of the vehicle, for a server of several.
            timeout_s: longest wait for the server.
            origin: the program's name for itself, which the server reports with its goals.
        """
        self.origin = origin
        self._name = name
        self._timeout_s = timeout_s
        self._opened: ServerLink | None = None
        self._flown: list[FlownGoal] = []

    async def __aenter__(self) -> AsyncVehicle:
        """Find the server.

        Raises:
            NavigationError: with NO_SERVER.
        """
        self._opened = await asyncio.to_thread(ServerLink, self._name)
        try:
            await self._find()
        except BaseException:
            await asyncio.to_thread(self._opened.close)
            raise
        return self

    async def _find(self) -> None:
        loop = asyncio.get_running_loop()
        until_s = loop.time() + self._timeout_s
        while self.link.state is None:
            if loop.time() > until_s:
                text = (
                    f"No server reports the state of {self._name or 'a vehicle'}; start "
                    "navigation_server in the same ROS domain."
                )
                raise NavigationError(NO_SERVER, text)
            await asyncio.sleep(_PERIOD_S)

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Cancel what is still flown, and end."""
        try:
            for goal in self._flown:
                if not goal.is_over:
                    with contextlib.suppress(NavigationError):
                        await goal.cancel()
        finally:
            await asyncio.to_thread(self.link.close)

    @property
    def link(self) -> ServerLink:
        """The connection, within the ``async with`` block."""
        if self._opened is None:
            raise RuntimeError("Use the vehicle in 'async with Vehicle() as vehicle:'.")
        return self._opened

    # --- state ---------------------------------------------------------------------------

    @property
    def state(self) -> ReportedState:
        """The newest state.

        Raises:
            NavigationError: with NO_SERVER, if the server has been silent for 8 s.
        """
        state = self.link.state
        if state is None:
            raise NavigationError(NO_SERVER, "The server is silent; the state is not known.")
        return state

    async def states(self, period_s: float = 0.2) -> AsyncIterator[ReportedState]:
        """Give the state again and again."""
        while True:
            yield self.state
            await asyncio.sleep(period_s)

    # --- goals ---------------------------------------------------------------------------

    def _fly(self, goal: ClientGoal) -> FlownGoal:
        return self._keep(FlownGoal(self.link, goal, self.origin))

    def _keep(self, goal: _Goal) -> _Goal:
        self._flown = [each for each in self._flown if not each.is_over]
        self._flown.append(goal)
        return goal

    def _avoids(self, avoid: bool | None) -> bool:
        return self.link.knows_obstacles if avoid is None else avoid

    def takeoff(self, height_m: float = 0.0) -> FlownGoal:
        """Arm if that is allowed, and take off to a height above ground; 0: the server's."""
        return self._fly(goals.take_off(height_m))

    def land(self) -> FlownGoal:
        """Land where the vehicle is."""
        return self._fly(goals.landing())

    def rtl(self) -> FlownGoal:
        """Return to the launch point, in the autopilot's own mode."""
        return self._fly(goals.return_to_launch())

    def goto(
        self,
        x: float,
        y: float,
        z: float,
        *,
        frame: str = FRAME_MAP,
        yaw_deg: float | None = None,
        speed_m_s: float = 0.0,
        avoid: bool | None = None,
    ) -> FlownGoal:
        """Fly to a position.

        Args:
            x: metres east, or forward in `base_link`, or the latitude in `wgs84`, degrees.
            y: metres north, or left, or the longitude.
            z: metres up, or the altitude above mean sea level.
            frame: `map`, `base_link` or `wgs84`.
            yaw_deg: counter-clockwise from x at the end; None faces the direction of travel.
            speed_m_s: highest ground speed; 0 is the server's default.
            avoid: whether obstacles are avoided; None: where the server knows any.
        """
        return self._fly(goals.point((x, y, z), frame, yaw_deg, speed_m_s, self._avoids(avoid)))

    def route(
        self,
        positions: Sequence[Vector3],
        *,
        frame: str = FRAME_MAP,
        hold_s: float | Sequence[float] = 0.0,
        speed_m_s: float = 0.0,
        laps: int = 1,
        as_mission: bool = False,
        avoid: bool | None = None,
    ) -> FlownGoal:
        """Fly a route, by setpoints or as a mission of the autopilot.

        Args:
            positions: its waypoints, each as those of `goto`.
            frame: `map` or `wgs84`.
            hold_s: hold time at all, or at each; 0 flies through.
            speed_m_s: highest ground speed; 0 is the server's default.
            laps: how often.
            as_mission: whether the autopilot flies it by itself.
            avoid: as for `goto`.
        """
        avoids = self._avoids(avoid)
        return self._fly(goals.route(positions, frame, hold_s, speed_m_s, avoids, laps, as_mission))

    def orbit(
        self,
        x: float,
        y: float,
        radius_m: float,
        *,
        height_m: float | None = None,
        laps: float = 1.0,
        speed_m_s: float = 0.0,
        yaw_mode: str = "centre",
        avoid: bool | None = None,
    ) -> FlownGoal:
        """Fly a circle around a position of the map.

        Args:
            x: metres east.
            y: metres north.
            radius_m: negative flies clockwise.
            height_m: above ground; None keeps the altitude.
            laps: may be a fraction; 0 flies until it is cancelled.
            speed_m_s: highest ground speed; 0 is the server's default.
            yaw_mode: `centre`, `tangent` or `keep`.
            avoid: as for `goto`.
        """
        avoids = self._avoids(avoid)
        return self._fly(goals.orbit((x, y), radius_m, height_m, laps, speed_m_s, yaw_mode, avoids))

    def steer(self, speed_m_s: float = 0.0) -> Steering:
        """Follow velocities that the program gives by `Steering.move`; until it is cancelled."""
        return self._keep(Steering(self.link, speed_m_s, self.origin))

    # --- requests ------------------------------------------------------------------------

    async def _ask(self, kind: type[Any], name: str, request: object) -> Any:
        """Return the response of a service that has done what was asked."""
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[Any] = loop.create_future()

        def put(response: object) -> None:
            if not answer.done():
                answer.set_result(response)

        def done(response: object) -> None:
            with contextlib.suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(put, response)

        self.link.post(partial(self.link.call, kind, name, request, done))
        response = await answer
        if isinstance(response, NavigationError):
            raise response
        if not response.success:
            raise NavigationError(REQUEST_REJECTED, response.message)
        return response

    async def hold(self) -> None:
        """Hold the position now, whatever is flown, whoever has sent it."""
        await self._ask(Trigger, "hold", Trigger.Request())

    async def pause(self) -> None:
        """Pause the goal until `resume`."""
        await self._ask(Trigger, "pause", Trigger.Request())

    async def resume(self) -> None:
        """Resume the goal."""
        await self._ask(Trigger, "resume", Trigger.Request())

    async def arm(self) -> None:
        """Arm, where the server allows it."""
        await self._ask(Trigger, "arm", Trigger.Request())

    async def disarm(self) -> None:
        """Disarm."""
        await self._ask(Trigger, "disarm", Trigger.Request())

    async def photo(self) -> None:
        """Take a photo."""
        await self._ask(Trigger, "trigger_camera", Trigger.Request())

    async def set_mode(self, mode: str) -> None:
        """Set the mode, by the firmware's own name; rejected while a goal is active."""
        await self._ask(SetMode, "set_mode", SetMode.Request(mode=mode))

    async def get_parameter(self, name: str) -> float:
        """Read a parameter of the autopilot."""
        request = GetVehicleParameter.Request(name=name)
        answer = await self._ask(GetVehicleParameter, "vehicle_parameters/get", request)
        return float(answer.parameter.value)

    async def set_parameter(self, name: str, value: float, *, while_armed: bool = False) -> None:
        """Change a parameter of the autopilot, which is read back.

        Args:
            name: its name.
            value: the new value.
            while_armed: whether it is changed although the vehicle is armed.
        """
        request = SetVehicleParameter.Request(
            name=name, value=float(value), while_armed=while_armed
        )
        await self._ask(SetVehicleParameter, "vehicle_parameters/set", request)
