"""One exploration: vehicles, servers and everybody else on one simulated clock."""

from __future__ import annotations

import itertools
import math
import traceback
from collections import deque
from collections.abc import Callable

from mavlink_sitl import GeoPoint, Obstacle, RangeSensor, Simulation, VehicleConfig, Wind, World
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.signing import KEY_SIZE, Signing
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge import notes
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import ServerConfig, make_config
from navigation_bridge.goals.goal import Annotation, GoalFeedback, GoalFinished
from navigation_bridge.goals.requests import Request
from navigation_bridge.recording.recorded_notes import NotesReader
from navigation_bridge.requests.payload_requests import (
    PayloadDone,
    PayloadRequests,
    PointGimbalRequest,
)
from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_bridge.traffic.vehicle_separation import VehicleSeparation
from navigation_core.searches import AT_ONCE, Searcher
from navigation_core.tasks.progress import Status
from navigation_core.tasks.traffic.negotiation import Negotiation, PeerState
from tests.explore.aircraft import Aircraft
from tests.explore.liar import Liar
from tests.explore.log import NOBODY, Asked, Log, PayloadAsked, PayloadEnded, Truth
from tests.explore.misreports import misreported
from tests.explore.releases import as_named
from tests.explore.ros_sensor import RosSensor
from tests.explore.scenario import Craft, Post, Scenario
from tests.explore.sizes import largest
from tests.support.flights.late_searches import LateSearcher
from tests.support.flights.peer_states import moved_state
from tests.support.messages.vehicle_clocks import Clock, with_clock

_TICK_S = 0.025
_TRUTH_S = 0.1
_READY_S = 90.0
_KEY = bytes(range(KEY_SIZE))
_UNIX_S = 1_800_000_000.0
_GIMBAL = {
    "ardupilot": {"MNT1_TYPE": 1.0},
    "px4": {"MNT_MODE_IN": 4.0, "MNT_RANGE_PITCH": 180.0},
}
_PLACES = {
    "LOCAL_POSITION_NED": ("x", "y", "z", "vx", "vy", "vz"),
    "GLOBAL_POSITION_INT": ("lat", "lon", "alt", "relative_alt", "vx", "vy", "vz"),
}
_RANGES = frozenset(
    {mavlink.MAVLINK_MSG_ID_OBSTACLE_DISTANCE, mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR}
)
_POSITIONS = frozenset(
    {mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT}
)
STATION = (255, 190)
# How many states of other servers a subscription keeps; how often a server sends its own, s.
_STATES_KEPT, _STATE_PERIOD_S = 20, 0.2


class Server:
    """A navigation server without ROS, on its end of a vehicle's link.

    Attributes:
        active: the goal that was accepted last and has not ended; empty for none.
        paused: whether its last feedback said so.
        traffic: its picture of the traffic; None where vehicles fly as if each were alone.
        inbox: states of other servers that it has not read yet, with the pictures they are of.
    """

    def __init__(
        self,
        config: ServerConfig,
        searcher: Searcher,
        ship: Ship,
        now: float,
        signing: Signing | None = None,
        traffic: SharedTraffic | None = None,
    ) -> None:
        """Start it."""
        self._ship = ship
        self.config = config
        self.vehicle = Vehicle(config.vehicle)
        self.traffic = traffic
        self.inbox: deque[tuple[SharedTraffic, PeerState]] = deque(maxlen=_STATES_KEPT)
        self._told_s = -math.inf
        name = _vehicle_name(ship.index)
        self.bridge = Bridge(self.vehicle, config.bridge, searcher, name=name)
        if traffic is not None:
            self.bridge.feature(VehicleSeparation).share(traffic)
        self.codec = Codec(1, 191, signing)
        self.active = ""
        self.paused = False
        self.stalled_until_s = -math.inf
        self._waiting: list[bytes] = []
        self.bridge.start(now)
        ship.log("server", "started")

    def turn(self, arrived: list[bytes], now: float) -> list[bytes]:
        """Take what has arrived and do what is due, as the driver does; return what it sends."""
        self._waiting += arrived
        if now < self.stalled_until_s:
            return []
        arrived, self._waiting = self._waiting, []
        bridge = self.bridge
        if self.traffic is not None:
            self._negotiate(self.traffic, now)
        for data in arrived:
            for message in self.codec.decode(data):
                clock = self._ship.vehicle_clock
                bridge.receive(message if clock is None else with_clock(message, clock, now), now)
        deadline = bridge.next_deadline()
        if deadline is not None and deadline <= now:
            bridge.handle_timer(now)
        frames = []
        for message in bridge.messages_to_send():
            frame = self.codec.encode(message)
            frames.append(frame)
            self._ship.log("sent", message, frame[10:-2].hex())
        self.collect()
        return frames

    def _negotiate(self, traffic: SharedTraffic, now: float) -> None:
        """Read the states of other servers, and send the own one when it is due."""
        if traffic.negotiation is None:
            return
        while self.inbox:
            sender, state = self.inbox.popleft()
            if traffic.earth is not None:
                traffic.negotiation.receive(moved_state(state, sender, traffic), now)
        if now - self._told_s < _STATE_PERIOD_S - 1e-6:
            return
        self._told_s = now
        traffic.look(now)
        if traffic.earth is not None:
            self._ship.tell_others(traffic, traffic.negotiation.state(traffic.alone(), now))

    def waits_for(self) -> int:
        """Return the vehicle that its own one waits for; -1 for none."""
        entries = {} if self.traffic is None else self.traffic.reservations.entries
        entry = entries.get(_vehicle_name(self._ship.index))
        if entry is None or entry.waiting is None:
            return NOBODY
        others = {_vehicle_name(i): i for i in range(self._ship.fleet_size)}
        return others.get(entry.waiting.whom, NOBODY)

    def collect(self) -> None:
        """Log what the bridge has to say."""
        while (output := self.bridge.next_output()) is not None:
            if isinstance(output, GoalFeedback):
                self.paused = output.status is Status.PAUSED
            if isinstance(output, GoalFinished):
                if output.goal_id == self.active:
                    self.active = ""
                self._ship.look()
            text = str(output.message.to_dict()) if isinstance(output, Annotation) else ""
            self._ship.log("output", output, text)
            self._ship.note(output)


class Ship:
    """A vehicle of an exploration with its server, or without one while that is killed."""

    def __init__(self, flight: Exploration, index: int, craft: Craft) -> None:
        """Start both."""
        self.index = index
        self.address = {"target_system": index + 1, "target_component": 1}
        self.craft = craft
        self._flight = flight
        self.sim = flight.simulation.vehicles[index]
        self.hostile = Codec(66, 1)
        self.foreign: list[bytes] = []
        self.mode = ""
        self._waits_for = NOBODY
        self._home_items = 1 if craft.autopilot == "ardupilot" else 0
        self._notes = Codec(1, notes.COMPONENT_ID)
        self._recorder = Codec(255, 190)
        self._recorded = NotesReader()
        self.full = self.blind = self.unlocated = False
        self.clock_off_s = 0.0
        self.vehicle_clock: Clock | None = None
        self.stuck: dict[str, Message] | None = None
        self._autopilot = Codec(index + 1, 1)
        self._stranger = Codec(*STATION)
        self._station = Codec(*STATION, self._signing())
        self._reader = Codec(index + 1, 1, self._signing())
        self.server: Server | None = None
        self.beside: Callable[[], None] | None = None  # of what moves beside it
        self.liars: list[Liar | Aircraft] = []
        self.met: list[Callable[[float], list[bytes]]] = []  # of other aircraft: what is reported
        self.misreport = ""
        self.sensor: RosSensor | None = None
        if craft.sensor:
            obstacles = flight.simulation.world.obstacles
            self.sensor = RosSensor(self.sim, craft.sensor, obstacles, flight.scenario.seed)
        self.stick_forward = 0.0
        self._sticks_due_s = 0.0
        if craft.signed:
            message = make("SETUP_SIGNING", **self.address, secret_key=_KEY, initial_timestamp=1)
            self.sim.link.write(self._stranger.encode(message))
        self.start_server()

    @property
    def now_s(self) -> float:
        """Simulated time."""
        return self._flight.now_s

    def next_number(self) -> int:
        """Return the number of a service request."""
        return int(self._flight.next_id(), 16)

    @property
    def fleet_size(self) -> int:
        """The number of vehicles."""
        return len(self._flight.scenario.crafts)

    @property
    def hovers(self) -> bool:
        """Whether it can stand still."""
        return self.craft.kind != "plane"

    def log(self, kind: str, value: object, text: str = "") -> None:
        """Append to the log."""
        self._flight.log.add(self._flight.now_s, self.index, kind, value, text)

    def start_server(self) -> None:
        """Start its server, unless it runs."""
        if self.server is None:
            config = make_config({"arming": "auto", **self.craft.server})
            takes_s, flight = self.craft.search_s, self._flight
            searcher = LateSearcher(lambda: flight.now_s, takes_s, 0.1) if takes_s else AT_ONCE
            signing = self._signing()
            traffic: SharedTraffic | None = None
            if flight.scenario.shares_traffic or self.craft.sees_traffic:
                traffic = SharedTraffic()
            if traffic is not None and flight.scenario.shares_traffic:
                own = f"/server{self.index}"
                epoch = round(1e3 * flight.now_s)
                traffic.negotiation = Negotiation(
                    traffic.reservations, own, epoch, now=flight.now_s
                )
            self.server = Server(config, searcher, self, flight.now_s, signing, traffic)
            self._waits_for = NOBODY

    def kill_server(self) -> None:
        """End its server without a word."""
        if self.server is not None:
            self.server = None
            self.log("server", "killed")

    def note(self, output: object) -> None:
        """Write into a recording what the server annotates."""
        if isinstance(output, Annotation):
            frame = self._notes.encode(
                with_source(output.message, self.index + 1, notes.COMPONENT_ID)
            )
            for message in self._recorder.decode(frame):
                self._recorded.take(self.now_s, message)

    def measure(self) -> None:
        """Log the server's size and the ends of goals in its recording."""
        if self.server is not None:
            self.log("size", largest(self.server.bridge))
        ends = {g.goal_id: (g.code, g.message) for g in self._recorded.goals if g.code}
        self.log("recorded", ends)

    def _hold_sticks(self) -> None:
        """Let the transmitter of a PX4's pilot send ten times a second."""
        if self.craft.sticks and self.now_s >= self._sticks_due_s:
            self._sticks_due_s = self.now_s + 0.1 - 1e-9
            self.sim.hold_sticks(self.stick_forward)

    def turn(self) -> None:
        """Let the server do what is due."""
        self._hold_sticks()
        true = self.sim.link.read_datagrams()
        lies = [frame for liar in self.liars for frame in liar.turn(true, self.now_s)]
        reports = [frame for met in self.met for frame in met(self.now_s)]
        arrived = true + lies + reports + self.foreign
        if self.stuck is not None:
            arrived = [self._repeated(data, self.stuck) for data in arrived]
        if self.blind:
            arrived = [data for data in arrived if _message_id(data) not in _RANGES]
        if self.unlocated:
            arrived = [data for data in arrived if _message_id(data) not in _POSITIONS]
        self.foreign = []
        if self.beside is not None:
            self.beside()
        if self.sensor is not None and self.server is not None and not self.blind:
            self.sensor.turn(self.server.bridge.obstacles, self.now_s)
        if self.server is None:
            return
        try:
            for frame in self.server.turn(arrived, self._flight.now_s):
                if not self.full:
                    self.sim.link.write(frame)
        except Exception:
            self.log("server", "failed", traceback.format_exc())
            raise

    def tell_others(self, traffic: SharedTraffic, state: PeerState) -> None:
        """Send the state of its server to the others, or what it reports instead."""
        if self.misreport == "silent":
            return
        state = misreported(state, self.misreport)
        for ship in self._flight.ships:
            if ship is not self and ship.server is not None:
                ship.server.inbox.append((traffic, state))

    def note_wait(self) -> None:
        """Log for which vehicle it waits, if that has changed."""
        whom = NOBODY if self.server is None else self.server.waits_for()
        if whom != self._waits_for:
            self._waits_for = whom
            self.log("waits", whom)

    def ask(self, request: Request) -> str:
        """Send a goal; return its id, or nothing if it was rejected."""
        if self.server is None:
            return ""
        now = self._flight.now_s
        rejection = self.server.bridge.goals.check(request, now)
        goal_id = "" if rejection is not None else self._flight.next_id()
        located = self.server.bridge.pose is not None
        self.log("asked", Asked(goal_id, request, rejection, located))
        if goal_id:
            self.server.active = goal_id
            self.server.bridge.goals.start(goal_id, request, now)
        self.server.collect()
        return goal_id

    def note_started(self, goal_id: str, request: Request) -> None:
        """Log a goal that its server has just begun by itself, if it has."""
        server = self.server
        goal = None if server is None else server.bridge.goals.active
        if server is not None and goal is not None and goal.goal_id == goal_id:
            self.log("asked", Asked(goal_id, request, None, server.bridge.pose is not None))
            server.active = goal_id

    def ask_payload(self, request: PointGimbalRequest | None) -> None:
        """Let a client point the gimbal, or take a photo."""
        if self.server is None:
            return
        number, now = self.next_number(), self._flight.now_s
        what = "photo" if request is None else "point"
        self.log("payload", PayloadAsked(number, what))
        requests = self.server.bridge.feature(PayloadRequests)

        def done(answer: PayloadDone) -> None:
            self.log("payload", PayloadEnded(number, what, answer.code, answer.message))

        if request is None:
            requests.take_photo(done, now)
        else:
            requests.point(request, done, now)
        self.server.collect()

    def hear_station(self, message: Message, through_server: bool, signed: bool = True) -> None:
        """Let a ground station send something."""
        data = (self._station if signed else self._stranger).encode(message)
        if through_server and self.server is not None:
            for parsed in self._reader.decode(data):
                self.server.bridge.overhear(parsed, self._flight.now_s)
            self.server.collect()
        self.sim.link.write(data)

    def mode_parameters(self, mode: str) -> tuple[float, float]:
        """Return the last two parameters of DO_SET_MODE for a mode's name."""
        modes = self.sim.firmware.personality.modes
        number = next(number for number, spec in modes.items() if spec.name == mode)
        if self.craft.autopilot == "px4":
            return float(number >> 16 & 0xFF), float(number >> 24)
        return float(number), 0.0

    def _signing(self) -> Signing | None:
        if not self.craft.signed:
            return None
        return Signing(_KEY, lambda: _UNIX_S + self._flight.now_s + self.clock_off_s)

    def _repeated(self, data: bytes, first: dict[str, Message]) -> bytes:
        """Return a frame with the place of the first one of its type."""
        messages = self._reader.decode(data) if not self.craft.signed else ()
        for message in messages:
            kind = message.get_type()
            if kind in _PLACES:
                held = first.setdefault(kind, message)
                for name in _PLACES[kind]:
                    setattr(message, name, getattr(held, name))
                return self._autopilot.encode(message)
        return data

    def look(self) -> None:
        """Log the true state of this moment."""
        self._flight.row = self._flight.simulation.truth
        self.log("truth", self.truth())

    def truth(self) -> Truth:
        """Return the true state."""
        self.mode = self.sim.firmware.mode.spec.name
        motion = self.sim.truth()
        firmware = self.sim.firmware
        row = self._flight.row
        return Truth(
            (motion[1], motion[0], -motion[2]),
            (motion[4], motion[3], -motion[5]),
            bool(row.on_ground[self.index]),
            firmware.armed,
            self.mode,
            bool(row.collided[self.index]),
            self.sim.clearance().distance_m
            if self._flight.simulation.world.obstacles
            else math.inf,
            tuple((item.x, item.y) for item in firmware.plans.mission.items[self._home_items :]),
            math.pi / 2.0 - motion[8],
        )


class Exploration:
    """Flies a scenario.

    Attributes:
        log: of all that happened.
        now_s: simulated time.
        row: the true state of all vehicles, at most 0.1 s old.
        ships: the vehicles.
    """

    def __init__(self, scenario: Scenario, log: Log) -> None:
        """Start vehicles and servers."""
        self.scenario = scenario
        self.log = log
        self.now_s = 0.0
        self._ids = itertools.count(1)
        self._truth_s = 0.0
        has_own = bool(scenario.posts) and not any(craft.sensor for craft in scenario.crafts)
        world = World(
            obstacles=tuple(_obstacle(i, post) for i, post in enumerate(scenario.posts)),
            range_sensor=RangeSensor(reach_m=20.0) if has_own else None,
            wind=Wind(scenario.wind_ned_m_s, scenario.gust_m_s),
        )
        configs = [_vehicle(craft) for craft in scenario.crafts]
        self.simulation = Simulation(
            vehicles=configs, seed=scenario.seed, world=world, tick_s=_TICK_S,
            collisions=scenario.shares_traffic,
        )  # fmt: skip
        for vehicle, craft in zip(self.simulation.vehicles, scenario.crafts, strict=True):
            if not craft.chatty:
                vehicle.silence_streams()
        self.row = self.simulation.truth
        self.ships = [Ship(self, i, craft) for i, craft in enumerate(scenario.crafts)]

    def next_id(self) -> str:
        """Return the id of the next goal."""
        return f"{next(self._ids):032x}"

    def run_for(self, seconds: float) -> None:
        """Continue for a while."""
        end_s = self.now_s + seconds - 1e-9
        while self.now_s < end_s:
            self.now_s = round(self.now_s + _TICK_S, 3)
            self.simulation.run_to_us(round(self.now_s * 1e6))
            due = self.now_s >= self._truth_s
            if due:
                self.row = self.simulation.truth
                self._truth_s = self.now_s + _TRUTH_S - 1e-9
            for ship in self.ships:
                if ship.sim.firmware.mode.spec.name != ship.mode:
                    # A server that hears of its mode at once answers within this turn.
                    ship.log("truth", ship.truth())
                ship.turn()
                if self.scenario.shares_traffic:
                    ship.note_wait()
                if due or ship.sim.firmware.mode.spec.name != ship.mode:
                    ship.log("truth", ship.truth())

    def run_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Continue until something holds; return whether it did in time."""
        end_s = self.now_s + timeout_s
        while not condition():
            if self.now_s >= end_s:
                return False
            self.run_for(0.1)
        return True

    def ready(self) -> bool:
        """Continue until all servers have a position."""
        servers = [ship.server for ship in self.ships]
        return self.run_until(
            lambda: all(s is not None and s.bridge.pose is not None for s in servers), _READY_S
        )


def _vehicle_name(index: int) -> str:
    return f"v{index}"


def _vehicle(craft: Craft) -> VehicleConfig:
    own = {"MIS_TKO_LAND_REQ": 0.0} if (craft.autopilot, craft.kind) == ("px4", "plane") else {}
    if craft.gimbal:
        own |= _GIMBAL[craft.autopilot]
    px4 = craft.autopilot == "px4"
    if craft.camera and not px4:
        own["CAM1_TYPE"] = 1.0
    named = (as_named(craft, name, value) for name, value in craft.onboard.items())
    return VehicleConfig(
        vehicle=craft.kind,
        autopilot=craft.autopilot,
        firmware=craft.firmware,
        home=GeoPoint(*craft.home),
        ready_after_s=1.0,
        battery_remaining=craft.battery,
        parameters={**own, **dict(each for each in named if each is not None)},
        photo_camera=craft.camera and px4,
    )


def _message_id(frame: bytes) -> int:
    """Return the message id of a MAVLink 2 frame; -1 of anything else."""
    return int.from_bytes(frame[7:10], "little") if frame[:1] == b"\xfd" else -1


def _obstacle(index: int, post: Post) -> Obstacle:
    east, north = post.at_enu_m
    return Obstacle(
        f"post {index}", (north, east), radius_m=post.radius_m, bottom_m=-1.0, top_m=post.height_m
    )
