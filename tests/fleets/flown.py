"""Fleets against the simulator on one simulated clock: bridges that share reservations, MAVLink."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from mavlink_sitl import (
    DEFAULT_HOME,
    GeoPoint,
    GpsQuality,
    LocalFrame,
    Simulation,
    VehicleConfig,
    Wind,
    World,
)
from mavlink_vehicle.codec import Codec
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.configuration.parameter_table import ParameterValue
from navigation_bridge.goals.goal import GoalFeedback, GoalFinished
from navigation_bridge.goals.requests import NavigateRequest, Request
from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_bridge.traffic.vehicle_separation import VehicleSeparation
from navigation_core.geometry import Vector3
from navigation_core.safety.target_checks import Rejection
from navigation_core.tasks.traffic.negotiation import Negotiation
from navigation_core.tasks.traffic.volumes import Separation
from tests.fleets.points import starts_and_targets
from tests.support.flights.peer_states import moved_state

TICK_S = 0.02
_STANDING_M = 0.5


@dataclass(frozen=True)
class Conditions:
    """Where and in what a fleet flies.

    Attributes:
        autopilot: "ardupilot" or "px4".
        home: of the first vehicle.
        world: its wind and GPS.
        speed_m_s: of all goals.
    """

    autopilot: str = "ardupilot"
    home: GeoPoint = DEFAULT_HOME
    world: World = field(default_factory=World)
    speed_m_s: float = 3.0


CONDITIONS = {
    "usual": Conditions(),
    "px4": Conditions("px4"),
    "far north": Conditions(home=GeoPoint(69.65, 18.95, 5.0)),
    "antimeridian": Conditions(home=GeoPoint(-16.79, 179.9999, 20.0)),
    "wind": Conditions(world=World(wind=Wind((5.0, -4.0, 0.0), gust_m_s=1.0))),
    "poor gps": Conditions(world=World(gps=GpsQuality(noise_m=0.3))),
    "fast": Conditions(speed_m_s=8.0),
}


@dataclass
class Craft:
    """One vehicle and its bridge.

    Attributes:
        name: its name in the reservations.
        bridge: what flies it.
        codec: of its link.
        row: its place in the simulation.
        server: which server it belongs to.
        linked: whether its link works.
        outputs: what its bridge put out, with times.
    """

    name: str
    bridge: Bridge
    codec: Codec
    row: int
    server: int
    linked: bool = True
    outputs: list[tuple[float, object]] = field(default_factory=list)

    def ends(self) -> list[tuple[float, GoalFinished]]:
        """Return how its goals have ended."""
        return [(t, out) for t, out in self.outputs if isinstance(out, GoalFinished)]

    def statuses(self) -> list[str]:
        """Return the statuses of its feedback, in order, each change once."""
        found = [out.status.value for _, out in self.outputs if isinstance(out, GoalFeedback)]
        return [status for status, _ in itertools.groupby(found)]


class FlownFleet:
    """Flies several vehicles of one server, or of several, in simulated time.

    Attributes:
        crafts: the vehicles.
        least_share: the least true separation, as a share of the demanded one; below 1 is a loss.
        worst: when and between whom.
    """

    def __init__(
        self,
        vehicles: Sequence[VehicleConfig],
        seed: int = 1,
        servers: Sequence[int] | None = None,
        together: bool = True,
        world: World | None = None,
        **parameters: ParameterValue,
    ) -> None:
        """Start all; vehicle ``i`` belongs to server ``servers[i]``, all to one by default.

        With ``together`` false each flies as if it were alone.
        """
        self.simulation = Simulation(
            vehicles, seed=seed, world=world, collisions=together, tick_s=0.01
        )
        self.now = 0.0
        self.separation = Separation()
        belongs = [0] * len(vehicles) if servers is None else list(servers)
        self.traffic = {one: SharedTraffic(self.separation) for one in set(belongs)}
        self.crafts: list[Craft] = []
        self.dead: set[int] = set()
        self.least_share, self.worst = math.inf, ""
        self.watches = together
        self.cut = False
        self._sent_s = -math.inf
        self.on_tick: Callable[[float], None] | None = None
        self._ids = itertools.count(1)
        for row, server in enumerate(belongs):
            name = f"v{row:02d}"
            own: dict[str, ParameterValue] = {"arming": "auto", "target_system": row + 1}
            config = make_config({**own, **parameters})
            vehicle = Vehicle(config.vehicle)
            bridge = Bridge(vehicle, config.bridge, name=name)
            if together:
                bridge.feature(VehicleSeparation).share(self.traffic[server])
            self.crafts.append(Craft(name, bridge, Codec(1, 191), row, server))
            bridge.start(0.0)

    def tick(self) -> None:
        """Continue by one tick."""
        self.now += TICK_S
        self.simulation.run_for(TICK_S)
        for craft in self.crafts:
            self._serve(craft)
        if self.on_tick is not None:
            self.on_tick(self.now)
        if self.watches:
            self._watch()

    def join(self) -> None:
        """Let the servers negotiate, 5 times a second, unless the network is ``cut``."""
        for server, traffic in self.traffic.items():
            traffic.negotiation = Negotiation(
                traffic.reservations, f"/server{server}", 1, now=self.now
            )
        self.on_tick = self._exchange
        self.run_for(3.0)

    def _exchange(self, now: float) -> None:
        if now - self._sent_s < 0.2:
            return
        self._sent_s = now
        for server, traffic in self.traffic.items():
            if server in self.dead or traffic.negotiation is None:
                continue
            traffic.look(now)
            state = traffic.negotiation.state(traffic.alone(), now)
            for other, receiver in self.traffic.items():
                if other not in (server, *self.dead) and not self.cut:
                    assert receiver.negotiation is not None
                    moved = moved_state(state, traffic, receiver)
                    receiver.negotiation.receive(moved, now)

    def _serve(self, craft: Craft) -> None:
        link, bridge, now = self.simulation.vehicles[craft.row].link, craft.bridge, self.now
        datagrams = list(link.read_datagrams())
        if craft.server in self.dead:
            return
        if craft.linked:
            for data in datagrams:
                for message in craft.codec.decode(data):
                    bridge.receive(message, now)
        deadline = bridge.next_deadline()
        if deadline is not None and deadline <= now:
            bridge.handle_timer(now)
        for message in bridge.messages_to_send():
            data = craft.codec.encode(message)
            if craft.linked:
                link.write(data)
        while (output := bridge.next_output()) is not None:
            craft.outputs.append((now, output))

    def _watch(self) -> None:
        """Compare true distances with the demanded separation, but for who is on the ground."""
        places = self.simulation.positions_ned_m
        level = np.hypot(*(places[:, None, :2] - places[:, :2]).transpose(2, 0, 1))
        upright = np.abs(places[:, None, 2] - places[:, 2])
        share = np.maximum(
            level / self.separation.horizontal_m, upright / self.separation.vertical_m
        )
        off = np.array([not craft.bridge.vehicle.state.armed for craft in self.crafts])
        stands = self.simulation.truth.on_ground & off
        share[stands] = share[:, stands] = np.inf
        share[np.diag_indices(len(places))] = np.inf
        if share.min() < self.least_share:
            a, b = np.unravel_index(int(share.argmin()), share.shape)
            self.least_share = float(share.min())
            self.worst = f"{self.now:.1f} s, {self.crafts[a].name}, {self.crafts[b].name}"

    def run_for(self, seconds: float) -> None:
        """Continue for a while."""
        end_s = self.now + seconds
        while self.now < end_s:
            self.tick()

    def run_until(self, condition: Callable[[], bool], timeout_s: float) -> None:
        """Continue until it holds; fail after ``timeout_s`` of simulated time."""
        end_s = self.now + timeout_s
        while not condition():
            assert self.now < end_s, f"not in {timeout_s:g} s: {self.report()}"
            self.tick()

    def ready(self) -> FlownFleet:
        """Continue until all can take goals."""
        self.run_until(lambda: all(c.bridge.pose is not None for c in self.crafts), 60.0)
        self.run_for(1.0)
        return self

    def place(self, craft: Craft, east_m: float, north_m: float, up_m: float) -> Vector3:
        """Return where a position relative to the first vehicle's home is in a craft's map."""
        home = self.simulation.vehicles[0].frame.to_geodetic(north_m, east_m, -up_m)
        geodetic = (home.latitude_deg, home.longitude_deg, home.altitude_amsl_m)
        return craft.bridge.map_frame.enu(geodetic)

    def send(self, craft: Craft, request: Request) -> str | Rejection:
        """Send a goal; return its id, or why it was rejected."""
        rejection = craft.bridge.goals.check(request, self.now)
        if rejection is not None:
            return rejection
        goal_id = f"{next(self._ids):032x}"
        craft.bridge.goals.start(goal_id, request, self.now)
        return goal_id

    def go(self, craft: Craft, east_m: float, north_m: float, up_m: float) -> str:
        """Send a craft to a position relative to the first vehicle's home; must be accepted."""
        place = self.place(craft, east_m, north_m, up_m)
        sent = self.send(craft, NavigateRequest("map", place, (0.0,) * 4, False, 0.0))
        assert isinstance(sent, str), sent
        return sent

    def run_to_end(self, timeout_s: float = 300.0) -> None:
        """Continue until no goal is active."""
        self.run_until(
            lambda: all(
                c.bridge.goals.active is None or c.server in self.dead for c in self.crafts
            ),
            timeout_s,
        )

    def report(self) -> str:
        """Say how each is doing."""
        lines = []
        for craft in self.crafts:
            ends = [end.message for _, end in craft.ends()]
            entry = self.traffic[craft.server].reservations.entries.get(craft.name)
            waiting = "" if entry is None or entry.waiting is None else entry.waiting.text
            lines.append(f"{craft.name} {ends[-1:]} {craft.statuses()[-2:]} {waiting}")
        return "\n".join(lines)

    @contextmanager
    def holding(self) -> Iterator[None]:
        """Check at the end that separation held and nobody crashed."""
        yield
        assert self.least_share >= 1.0, f"separation lost: {self.least_share:.2f}, {self.worst}"
        assert not self.simulation.truth.collided.any(), "vehicles have collided"


def homes(
    places: Sequence[tuple[float, float]],
    origin: GeoPoint = DEFAULT_HOME,
    firmware: str = "ardupilot",
) -> list[GeoPoint]:
    """Return homes at metres east and north of ``origin``."""
    personality = VehicleConfig(autopilot=firmware).personality()
    frame = LocalFrame(origin, personality.projection)
    return [frame.to_geodetic(north, east, 0.0) for east, north in places]


def flown_crossing(
    seed: int, count: int, side_m: float, conditions: Conditions = CONDITIONS["usual"]
) -> tuple[float, float, str]:
    """Fly one seed alone and together; return ratio of times, least share, and what went wrong."""
    pairs = starts_and_targets(seed, count, side_m, 9.0)
    quick = {"GUID_TIMEOUT": 1.0} if conditions.autopilot == "ardupilot" else {}
    places = homes([start[:2] for start, _ in pairs], conditions.home, conditions.autopilot)
    sums = []
    fleet = None
    for together in (False, True):
        configs = [
            VehicleConfig(
                autopilot=conditions.autopilot, home=home, ready_after_s=1.0, parameters=quick
            )
            for home in places
        ]
        fleet = FlownFleet(
            configs,
            seed,
            together=together,
            world=conditions.world,
            speed_default_m_s=conditions.speed_m_s,
        ).ready()
        begun_s, (east_m, north_m, _) = fleet.now, pairs[0][0]
        for craft, (_, target) in zip(fleet.crafts, pairs, strict=True):
            fleet.go(craft, target[0] - east_m, target[1] - north_m, target[2])
        try:
            fleet.run_to_end(400.0)
        except AssertionError as error:
            return math.inf, fleet.least_share, str(error)
        sums.append(sum(craft.ends()[0][0] - begun_s for craft in fleet.crafts))
    assert fleet is not None
    fault = ""
    if fleet.least_share < 1.0 or fleet.simulation.truth.collided.any():
        fault = f"separation lost: {fleet.least_share:.2f}, {fleet.worst}"
    elif any(craft.ends()[0][1].code.value != "SUCCESS" for craft in fleet.crafts):
        fault = f"not arrived: {fleet.report()}"
    return sums[1] / sums[0], fleet.least_share, fault
