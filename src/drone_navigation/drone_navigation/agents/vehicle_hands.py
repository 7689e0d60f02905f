"""The vehicle as the tools of an agent reach it: read, rehearsed, held, and flown once released."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

from drone_navigation.agents.acts import (
    AgentAct,
    AgentGoto,
    AgentLanding,
    AgentOrbit,
    AgentReturn,
    AgentRoute,
    AgentTakeoff,
    AgentWaypoint,
)
from drone_navigation.agents.envelopes import extent_of
from drone_navigation.agents.proposals import AgentProposal, Judgement, ToolRejection
from drone_navigation.agents.rehearsed_scenes import scene_of
from drone_navigation.agents.vehicle_view import VehicleView
from drone_navigation.console.messages import PageWaypoint, Rehearse
from drone_navigation.console.page_types import JsonObject
from drone_navigation.programs.async_vehicle import AsyncVehicle
from drone_navigation.programs.errors import NavigationError
from drone_navigation.programs.flown_goal import FlownGoal
from flight_logs.errors import LogError
from flight_reports.planned_flight import PlannedFlight
from navigation_core.geometry import Vector3

__all__ = ["VehicleHands"]

_REHEARSAL_S = 30.0
_POSITION_S = 5.0
"""From the start of this process, topics take a moment"""
_LOOK_S = 0.1
_EVENTS = 20


class VehicleHands:
    """One vehicle, in the event loop."""

    def __init__(
        self,
        vehicle: AsyncVehicle,
        agent: str,
        view: VehicleView,
        finish: Callable[[AgentProposal, str, str], None],
        pictures: Path,
        recordings: Path | None,
    ) -> None:
        """Use it.

        Args:
            vehicle: what is flown.
            agent: its name, for the server's reports.
            view: what is seen of it.
            finish: gets the end of a flight: its code and a sentence.
            pictures: folder for pictures.
            recordings: the server's recording, or the folder of them; None if there is none.
        """
        self._vehicle = vehicle
        self._agent = agent
        self._view = view
        self._finish = finish
        self._pictures, self._drawing = pictures, asyncio.Lock()
        self._recordings, self._reading = recordings, asyncio.Lock()
        self._numbers = itertools.count(1)
        self._flights: set[asyncio.Task[None]] = set()

    @property
    def position_enu_m(self) -> Vector3 | None:
        """Where the vehicle is; None while unknown."""
        return self._view.position_enu_m

    @property
    def is_flying(self) -> bool:
        """Whether it is armed and off the ground."""
        return self._view.is_flying

    async def pause(self, seconds: float) -> float:
        """Let others work for some time; return the time then, s."""
        await asyncio.sleep(seconds)
        return asyncio.get_running_loop().time()

    def read(self, name: str) -> object:
        """Return the state of the vehicle, obstacles, bounds or the last events, for JSON."""
        if name == "bounds":
            return {each: self._view.value(each) for each in ("flight_volume", "fence")}
        if name == "obstacles":
            return self._view.value("obstacles") or {}
        if name == "events":
            return (self._view.value("events") or [])[-_EVENTS:]
        try:
            state = asdict(self._vehicle.state)
        except NavigationError as error:
            raise ToolRejection(error.code, error.message) from None
        motion = self._view.value("motion") or {}
        moves = {"speed_m_s": motion.get("speed"), "climb_m_s": motion.get("climb")}
        return {**state, **moves, "home": self._view.value("home")}

    async def report(self) -> object:
        """Return the report of the newest recording, for JSON.

        Raises:
            ToolRejection: there is none, or it cannot be read.
        """
        async with self._reading:
            try:
                return await asyncio.to_thread(_report, self._recordings)
            except (LogError, OSError) as error:
                raise ToolRejection("NO_RECORDING", str(error)) from None

    async def hold(self) -> None:
        """Hold now."""
        try:
            await self._vehicle.hold()
        except NavigationError as error:
            raise ToolRejection(error.code, error.message) from None

    async def rehearse(self, act: AgentAct) -> Judgement:
        """Rehearse an act, where the simulator can."""
        start = await self._position_soon()
        if start is None:
            return Judgement("NO_POSITION", "The vehicle's position is not known.")
        if isinstance(act, AgentTakeoff) and self.is_flying:
            return Judgement("ALREADY_FLYING", "The vehicle is in the air.")
        order = Rehearse(
            self._view.vehicle,
            tuple(PageWaypoint(w.position_enu_m, w.hold_s) for w in _waypoints(act)),
            getattr(act, "speed_m_s", 0.0),
            getattr(act, "laps", 1),
            getattr(act, "avoid_obstacles", False),
            getattr(act, "radius_m", 0.0),
            next(self._numbers),
        )
        loop = asyncio.get_running_loop()
        result: asyncio.Future[JsonObject] = loop.create_future()

        def put(message: JsonObject) -> None:
            if not result.done():
                result.set_result(message)

        def tell(message: JsonObject) -> None:
            with contextlib.suppress(RuntimeError):  # the loop is closed
                loop.call_soon_threadsafe(put, message)

        self._view.rehearse(order, _steps(act), tell)
        try:
            answer = await asyncio.wait_for(result, _REHEARSAL_S)
        except asyncio.TimeoutError:
            answer = {"error": f"it took longer than {_REHEARSAL_S:g} s."}
        return self._judge(act, answer, start)

    async def _position_soon(self) -> Vector3 | None:
        """Return where the vehicle is, as soon as it is known; None if it does not become so."""
        loop = asyncio.get_running_loop()
        until_s = loop.time() + _POSITION_S
        while self.position_enu_m is None and loop.time() < until_s:
            await asyncio.sleep(_LOOK_S)
        return self.position_enu_m

    def _judge(self, act: AgentAct, answer: JsonObject, start: Vector3) -> Judgement:
        if "error" in answer:
            text = f"It could not be rehearsed: {answer['error']}"
            return Judgement("", text, None, start, self.is_flying)
        flown = answer["rehearsal"]
        if not flown["accepted"]:
            return Judgement(flown["code"], flown["text"])
        lacks = answer.get("lacks") or ()
        text = flown["text"] + (f" Not considered: {', '.join(lacks)}." if lacks else "")
        extent, targets = extent_of(flown), [w.position_enu_m for w in _waypoints(act)]
        title = f"{act.sentence}\n{extent.sentence}"
        scene = scene_of(title, flown, targets, self._view.value)
        return Judgement(flown["code"], text, extent, start, self.is_flying, scene)

    async def draw(self, proposal: AgentProposal) -> Path:
        """Draw the flight of a proposal, once; return the PNG file.

        Raises:
            ToolRejection: it was not rehearsed, or the file cannot be written.
        """
        scene = proposal.judgement.scene if proposal.judgement else None
        if scene is None:
            raise ToolRejection("NO_PICTURE", "The proposal was not rehearsed.")
        picture = self._pictures / f"{proposal.id}.png"
        async with self._drawing:
            if not picture.exists():
                try:
                    await asyncio.to_thread(_draw, scene, picture)
                except OSError as error:
                    text = f"It cannot be written: {error.strerror}."
                    raise ToolRejection("NO_PICTURE", text) from None
        return picture

    def fly(self, proposal: AgentProposal) -> None:
        """Begin what was released."""
        task = asyncio.get_running_loop().create_task(self._fly(proposal))
        self._flights.add(task)
        task.add_done_callback(self._flights.discard)

    async def _fly(self, proposal: AgentProposal) -> None:
        try:
            by = proposal.released_by
            self._vehicle.origin = f"agent {self._agent}, released by {by} as {proposal.id}"
            end = await self._goal(proposal.act)
            self._finish(proposal, end.code, end.message.removeprefix(f"{end.code}: "))
        except NavigationError as error:
            self._finish(proposal, error.code, error.message)

    def _goal(self, act: AgentAct) -> FlownGoal:
        vehicle = self._vehicle
        if isinstance(act, AgentTakeoff):
            return vehicle.takeoff(act.height_m)
        if isinstance(act, AgentLanding):
            return vehicle.land()
        if isinstance(act, AgentReturn):
            return vehicle.rtl()
        if isinstance(act, AgentOrbit):
            return vehicle.orbit(
                act.x_m,
                act.y_m,
                act.radius_m,
                height_m=act.height_m,
                laps=act.laps,
                speed_m_s=act.speed_m_s,
                avoid=act.avoid_obstacles,
            )
        if isinstance(act, AgentGoto):
            return vehicle.goto(
                act.x_m, act.y_m, act.z_m, speed_m_s=act.speed_m_s, avoid=act.avoid_obstacles
            )
        return vehicle.route(
            [w.position_enu_m for w in act.waypoints],
            hold_s=[w.hold_s for w in act.waypoints],
            speed_m_s=act.speed_m_s,
            laps=act.laps,
            avoid=act.avoid_obstacles,
        )


def _report(recordings: Path | None) -> JsonObject:
    """Raises LogError and OSError."""
    from flight_reports.report_values import report_values  # noqa: PLC0415 - seldom

    if recordings is None:
        raise LogError("This agent was started without --tlog.")
    newest = recordings
    if recordings.is_dir():
        found = sorted(recordings.glob("*.tlog"), key=lambda path: path.stat().st_mtime)
        if not found:
            raise LogError(f"There is no tlog in {recordings}.")
        newest = found[-1]
    return {"recording": str(newest), "flights": report_values(newest)}


def _draw(scene: PlannedFlight, picture: Path) -> None:
    from flight_reports.rehearsal_plot import plot_planned  # noqa: PLC0415 - imports matplotlib

    plot_planned(scene, picture)


def _waypoints(act: AgentAct) -> tuple[AgentWaypoint, ...]:
    """Return the waypoints that a rehearsal flies; none for an act that is a step of a plan."""
    if isinstance(act, AgentRoute):
        return act.waypoints
    if isinstance(act, AgentGoto):
        return (AgentWaypoint(act.x_m, act.y_m, act.z_m),)
    if isinstance(act, AgentOrbit):
        return (AgentWaypoint(act.x_m, act.y_m, act.height_m),)
    return ()


def _steps(act: AgentAct) -> tuple[JsonObject, ...]:
    """Return the steps that a rehearsal flies instead of waypoints, as `flight_rehearsal` has."""
    if isinstance(act, AgentTakeoff):
        return ({"kind": act.kind, "height": act.height_m},)
    if isinstance(act, AgentLanding | AgentReturn):
        return ({"kind": act.kind},)
    return ()
