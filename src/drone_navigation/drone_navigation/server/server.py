"""A server with all its vehicles: nodes, links and driver thread."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial

from rclpy.node import Node
from rclpy.parameter import Parameter

from drone_navigation.presence import duplicate
from drone_navigation.server.features import SHARED_FEATURES, SharedFeature
from drone_navigation.server.lateness.lateness_trace import LatenessTrace
from drone_navigation.server.lateness.short_collections import ShortCollections
from drone_navigation.server.parameters import (
    current_values,
    declare_vehicle_parameters,
    refuse_changes,
)
from drone_navigation.server.replay_node import ReplayFleet, ReplayNetwork, ReplayNode, recording_of
from drone_navigation.server.spinning import Spinner
from drone_navigation.server.vehicle_node import VehicleNode
from mavlink_vehicle.io.clock import Clock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.endpoints import LinkStatistics
from navigation_bridge.configuration.fleet_config import check_fleet, make_vehicle_config
from navigation_bridge.configuration.make_config import ServerConfig, make_config
from navigation_bridge.configuration.parameter_file import check_keys
from navigation_bridge.configuration.parameter_table import SERVER_WIDE, ParameterValue
from navigation_bridge.fleet import FleetApplication, Member
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_bridge.network import Network, open_network
from navigation_bridge.recording.replay_driver import ReplayDriver
from navigation_bridge.search_thread import SearchThread
from navigation_core.searches import AT_ONCE, Searcher

# A stop takes less than STOP_LIMIT_S (`stop_signals`), whatever is pending.
_STOP_VEHICLES_S = 2.5
_RELEASE_S = 0.5
_ANSWERS_S = 0.5
_RESULT_GRACE_S = 0.3
_SPINNERS_S = 0.4
_DRIVER_S = 0.3
_LOOK_S = 0.02
_LINK_GRACE_S = 0.5
# To look for other servers of a vehicle's name walks through all readers and writers of the domain.
_LOOKS_MAX = 5
_REMAPS = ("-r", "--remap")
_NODE_REMAPS = ("__ns:=", "__node:=", "__name:=")


class NavigationServer:
    """The vehicles of a server, on one driver thread; without ``vehicles``, one.

    With one vehicle without a name, its node is the server's.
    """

    def __init__(
        self,
        root: Node,
        spinner: Spinner,
        given: list[Parameter],
        argv: list[str],
        clock: Clock,
        on_exit: ExitStack,
        resumed: bool = False,
    ) -> None:
        """Create nodes and open links; nothing is sent before :meth:`start`.

        Args:
            root: the server's node, with its parameters.
            spinner: of that node; its owner starts and stops it.
            given: parameters that the command line sets for every vehicle.
            argv: the command line, for the vehicles' nodes.
            clock: the time of all vehicles.
            on_exit: destroys what was made.
            resumed: whether the process has recorded already, and continues with that.

        Raises:
            ConfigurationError: parameters cannot be used.
            LinkError: a link cannot be opened, or the file of the signing key holds none.
            OSError: the recording cannot be written.
        """
        values = current_values(root)
        config = make_config(values)
        self._spinners: list[Spinner] = []
        settings = [(root, values, config)]
        if config.vehicles:
            settings = list(_vehicle_settings(root, values, config, given, argv, on_exit))
            check_fleet(dict(zip(config.vehicles, (own for _, _, own in settings), strict=True)))
        nodes = [root, *(node for node, _, _ in settings)]
        check_keys(argv, [node.get_fully_qualified_name() for node in nodes])
        configs = [made for _, _, made in settings]
        network: Network | ReplayNetwork
        recording = recording_of(config, configs)
        if recording is None:
            logger = root.get_logger()
            network = open_network(config, configs, logger.info, logger.warning, resumed)
        else:
            component = config.vehicle.source_component
            network = ReplayNetwork(ReplayDriver(recording, config.replay_speed, component))
            clock = network.driver.clock
        searcher: Searcher = AT_ONCE
        self._searches: SearchThread | None = None
        if recording is None:
            searcher = self._searches = SearchThread()
            on_exit.callback(self._searches.close)
        if config.vehicles:
            refuse_changes(root, settings[0][0].get_fully_qualified_name())
            self._spinners = [Spinner(node) for node, _, _ in settings]
        self._collections = ShortCollections()
        on_exit.callback(self._collections.close)
        self._network = network
        self._shared: list[SharedFeature] = []
        if recording is None:
            self._shared = [make(root, config, clock) for make in SHARED_FEATURES]
        self._vehicles = [
            VehicleNode(node, own, made, network.recorder, clock, turns, searcher, self._shared)
            for (node, own, made), turns in zip(settings, self._spinners or [spinner], strict=True)
        ]
        self._looked = deque(self._vehicles)
        self._driver: Driver | ReplayDriver
        if isinstance(network, ReplayNetwork):
            self._driver = network.driver
            fleet = ReplayFleet(self._vehicles, clock)
            network.driver.play_to(fleet)
            self._fleet: FleetApplication = fleet
            self._replay = ReplayNode(root, self._vehicles, network.driver)
        else:
            self._fleet = FleetApplication([vehicle.member for vehicle in self._vehicles], clock)
            self._driver = network.drive(self._fleet, clock)
        self._fleet.attach(self._driver)
        for feature in self._shared:
            feature.serve(self._vehicles[0].member)
        for vehicle in self._vehicles:
            statistics = partial(_statistics, network, vehicle.member)
            first = vehicle is self._vehicles[0]
            vehicle.serve(statistics, network.station_links if first else None)

    @property
    def running(self) -> bool:
        """True while any vehicle is under control."""
        return self._driver.running and not self._fleet.lost

    @property
    def duplicate(self) -> str:
        """Advice about an earlier server of the same name; empty without one."""
        for vehicle in self._vehicles:
            if vehicle.presence.is_second:
                return duplicate(vehicle.node)
        return ""

    def start(self, trace: LatenessTrace | None = None) -> None:
        """Start communication with the vehicles; goals are rejected before :meth:`activate`.

        Args:
            trace: times the turns of the driver, unless a recording is played.
        """
        if trace is not None and isinstance(self._driver, Driver):
            trace.follow(self._driver)
        self._driver.start()
        # A peer or a device that is there is connected to by then.
        _wait(lambda: all(map(self._is_open, self._vehicles)), _LINK_GRACE_S)
        for vehicle in self._vehicles:
            vehicle.start(self._is_open(vehicle))
        for spinner in self._spinners:
            spinner.start()
        if self._searches is not None:
            self._searches.run(self._begin_collections)
        self._prepare_searches()

    def activate(self) -> None:
        """Accept goals."""
        for vehicle in self._vehicles:
            vehicle.activate()

    def deactivate(self) -> None:
        """Reject goals, stop the vehicles and end their goals, in bounded time."""
        for vehicle in self._vehicles:
            vehicle.deactivate()
        self._end_goals()

    def check_links(self, is_new: bool) -> None:
        """Log newly opened links, look for other servers, free memory; call periodically.

        Args:
            is_new: whether to look for others of all names, which else are looked for in turn.
        """
        self._collections.tend(self._at_rest)
        self._prepare_searches()
        for _ in range(len(self._looked) if is_new else min(_LOOKS_MAX, len(self._looked))):
            self._looked[0].presence.look()
            self._looked.rotate(-1)
        for vehicle in self._vehicles:
            if not vehicle.ready_logged and self._is_open(vehicle):
                vehicle.log_ready()

    def _prepare_searches(self) -> None:
        """Load what searches among obstacles may need, once there are some: a third of the memory.

        Ways around other vehicles need it so seldom that the search which does loads it.
        """
        if self._searches is None or self._searches.is_warm:
            return
        if any(vehicle.has_to_avoid for vehicle in self._vehicles):
            self._searches.warm_up(self._begin_collections)

    def _begin_collections(self) -> None:
        self._collections.begin(self._at_rest)

    @property
    def _at_rest(self) -> bool:
        """Whether no vehicle is armed or has a goal."""
        return all(vehicle.is_at_rest for vehicle in self._vehicles)

    def _is_open(self, vehicle: VehicleNode) -> bool:
        return self._network.is_open(vehicle.config.link_url)

    def stop(self, beside: Sequence[Spinner] = ()) -> None:
        """Stop the vehicles, end their goals and close everything, in bounded time.

        Args:
            beside: further threads that are stopped before the driver's.

        Raises:
            DriverError: the driver's thread hangs; what it has not sent is not sent any more.
        """
        for vehicle in self._vehicles:
            vehicle.shut_down()
        answers = self._end_goals()
        for vehicle in self._vehicles:
            vehicle.close()
        answers = answers or self._is_busy()
        _wait(lambda: not self._is_busy(), _ANSWERS_S)
        if answers:
            threading.Event().wait(_RESULT_GRACE_S)  # for them to reach the clients
        for vehicle in self._vehicles:
            vehicle.abandon()  # one that was accepted in the last moment
        for feature in self._shared:
            feature.close()
        if spinners := [*self._spinners, *beside]:
            with ThreadPoolExecutor(len(spinners)) as together:
                for spinner in spinners:
                    together.submit(spinner.stop, _SPINNERS_S)
        try:
            self._driver.stop(_DRIVER_S)
        finally:
            for vehicle in self._vehicles:
                vehicle.log_what_is_left(isinstance(self._driver, ReplayDriver))

    def _end_goals(self) -> bool:
        """Wait for the ends of the vehicles' goals; return whether there were any."""

        def is_over() -> bool:
            return all(vehicle.is_idle() for vehicle in self._vehicles) or not self.running

        if all(vehicle.is_idle() for vehicle in self._vehicles):
            return False
        if not _wait(is_over, _STOP_VEHICLES_S):
            for vehicle in self._vehicles:
                vehicle.release()
            _wait(is_over, _RELEASE_S)
        for vehicle in self._vehicles:
            vehicle.abandon()
        return True

    def _is_busy(self) -> bool:
        return any(vehicle.is_busy for vehicle in self._vehicles)


def _wait(condition: Callable[[], bool], timeout_s: float) -> bool:
    """Wait until something holds; return whether it does, in time."""
    deadline_s, pause = time.monotonic() + timeout_s, threading.Event()
    while not condition():
        if time.monotonic() >= deadline_s:
            return False
        pause.wait(_LOOK_S)
    return True


def _statistics(network: Network | ReplayNetwork, member: Member) -> LinkStatistics:
    found = network.statistics_of(member.system_id)
    found.throttled += member.throttled
    return found


def _vehicle_settings(
    root: Node,
    values: dict[str, ParameterValue],
    config: ServerConfig,
    given: list[Parameter],
    argv: list[str],
    on_exit: ExitStack,
) -> Iterable[tuple[Node, dict[str, ParameterValue], ServerConfig]]:
    """Create a node for each vehicle and yield it with its values and settings."""
    own_given = [parameter for parameter in given if parameter.name not in SERVER_WIDE]
    for name in config.vehicles:
        node = Node(
            SERVER_NODE_NAME,
            namespace=f"{root.get_namespace().rstrip('/')}/{name}",
            cli_args=vehicle_arguments(argv),
            use_global_arguments=False,
            parameter_overrides=own_given,
            context=root.context,
        )
        on_exit.callback(node.destroy_node)
        own = declare_vehicle_parameters(node, name, values)
        yield node, own, make_vehicle_config(name, own)


def vehicle_arguments(argv: list[str]) -> list[str]:
    """Return a server's arguments for ROS without those that rename or move all its nodes.

    Parameters and remapped topics are for the vehicles, too; a node name or a namespace, which
    is the server's, would make them all one.
    """
    kept: list[str] = []
    inside = False
    words = iter(argv)
    for word in words:
        inside = (inside or word == "--ros-args") and word != "--"
        if not inside:
            continue
        if word in _REMAPS:
            rule = next(words, "")
            if not rule.startswith(_NODE_REMAPS):
                kept += [word, rule]
        else:
            kept.append(word)
    return kept
