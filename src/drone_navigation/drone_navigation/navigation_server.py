"""The navigation server: ``ros2 run drone_navigation navigation_server``."""

from __future__ import annotations

import argparse
import signal
import sys
import threading
import traceback
from pathlib import Path
from types import FrameType

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from drone_navigation import notes
from drone_navigation.actions import GoalServers
from drone_navigation.bridge import Bridge
from drone_navigation.check_command import run_check
from drone_navigation.configuration import (
    ConfigurationError,
    ServerConfig,
    make_config,
    read_parameter_file,
)
from drone_navigation.goal import (
    Annotation,
    GoalFeedback,
    GoalFinished,
    GoalHappened,
    GoalRejected,
    LogLevel,
    LogLine,
    PlanChanged,
    ServiceDone,
)
from drone_navigation.names import SERVER_NODE_NAME
from drone_navigation.parameter_table import ParameterValue
from drone_navigation.parameters import declare_parameters, follow_changes
from drone_navigation.sensor_topics import SensorTopics
from drone_navigation.server_options import make_parser, overrides
from drone_navigation.service_servers import ServiceServers
from drone_navigation.topics import Topics
from mavlink_vehicle.codec import Codec, Message
from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.clock import MonotonicClock
from mavlink_vehicle.io.driver import Driver
from mavlink_vehicle.io.links import open_link
from mavlink_vehicle.io.signing_key import open_signing
from mavlink_vehicle.io.tlog import TlogWriter
from mavlink_vehicle.vehicle import Vehicle
from navigation_core.outcomes import OutcomeCode

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_USAGE = 2
# One thread for each goal that is parked on its event, and some for goal, cancel and
# result requests. A replaced goal leaves its thread within milliseconds.
_EXECUTOR_THREADS = 8
_STOP_TIMEOUT_S = 3.0
_RESULT_GRACE_S = 0.3
_WATCH_PERIOD_S = 0.5


class ServerApplication:
    """What the driver runs: the bridge, and the way of its outputs to ROS and recorder."""

    def __init__(self, bridge: Bridge, recorder: TlogWriter | None, clock: MonotonicClock) -> None:
        """Compose; :meth:`attach` must follow before the driver starts."""
        self._bridge = bridge
        self._recorder = recorder
        self._clock = clock
        self._notes = Codec(source_system=1, source_component=notes.COMPONENT_ID)
        self._server: GoalServers | None = None
        self._services: ServiceServers | None = None
        self._topics: Topics | None = None
        self._node: Node | None = None

    def attach(
        self, node: Node, server: GoalServers, services: ServiceServers, topics: Topics
    ) -> None:
        """Say where outputs go."""
        self._node, self._server, self._topics = node, server, topics
        self._services = services

    def start(self, now: float) -> None:
        """Start the bridge."""
        self._bridge.start(now)

    def receive(self, message: Message, now: float) -> None:
        """Hand a message over and publish what follows from it at once."""
        self._bridge.receive(message, now)
        self._publish()
        if self._topics is not None:
            self._topics.update(now)

    def handle_timer(self, now: float) -> None:
        """Let the bridge do what is due."""
        self._bridge.handle_timer(now)
        self._publish()
        if self._topics is not None:
            self._topics.update(now)

    def next_deadline(self) -> float | None:
        """Return when the bridge wants to be called."""
        deadline = self._bridge.next_deadline()
        if self._topics is None:
            return deadline
        own = self._topics.next_deadline()
        return own if deadline is None else min(own, deadline)

    def messages_to_send(self) -> list[Message]:
        """Return what is to be sent, after publishing what a request brought about."""
        self._publish()
        return self._bridge.messages_to_send()

    def fail(self, error: Exception) -> None:
        """End the active goal because of a defect, and tell it with its traceback."""
        text = "".join(traceback.format_exception(type(error), error, error.__traceback__))
        if self._node is not None:
            self._node.get_logger().error(f"Internal error: {text}")
        self._bridge.fail(
            f"The server has a defect ({error}); the vehicle was told to hold.", self._clock.now()
        )
        self._publish()

    def _publish(self) -> None:
        while (output := self._bridge.next_output()) is not None:
            if isinstance(output, GoalFeedback):
                self._publish_feedback(output)
            elif isinstance(output, GoalFinished) and self._server is not None:
                self._server.finish(output)
            elif isinstance(output, (GoalRejected, GoalHappened, PlanChanged)):
                self._publish_topic(output)
            elif isinstance(output, ServiceDone) and self._services is not None:
                self._services.finish(output)
            elif isinstance(output, LogLine) and self._node is not None:
                _log(self._node, output)
            elif isinstance(output, Annotation) and self._recorder is not None:
                self._recorder.write(self._notes.encode(output.message))

    def _publish_topic(self, output: GoalRejected | GoalHappened | PlanChanged) -> None:
        if self._topics is None:
            return
        if isinstance(output, GoalRejected):
            self._topics.publish_rejection(output.text)
        elif isinstance(output, GoalHappened):
            self._topics.publish_event(output)
        else:
            self._topics.publish_plan(output)

    def _publish_feedback(self, feedback: GoalFeedback) -> None:
        if self._server is not None:
            self._server.publish_feedback(feedback)


def _log(node: Node, line: LogLine) -> None:
    # rclpy keys its "once" and "throttle" filters by call site, so that one severity for
    # each place is required.
    logger = node.get_logger()
    if line.level is LogLevel.ERROR:
        logger.error(line.text)
    elif line.level is LogLevel.WARN:
        logger.warning(line.text)
    else:
        logger.info(line.text)


def main(args: list[str] | None = None) -> int:
    """Run the server until it is told to stop; return the exit code."""
    argv = list(sys.argv if args is None else ["navigation_server", *args])
    arguments = remove_ros_args(argv)
    ros_arguments = len(arguments) < len(argv)
    parser = make_parser()
    options = parser.parse_args(arguments[1:])
    if options.json and not options.check:
        parser.error("--json is for --check")
    try:
        values: dict[str, ParameterValue] = {}
        if options.config is not None:
            values = read_parameter_file(Path(options.config), SERVER_NODE_NAME)
        if options.check:
            return _check(options, values, ros_arguments)
    except (ConfigurationError, LinkError, OSError) as error:
        print(f"navigation_server: {error}", file=sys.stderr)
        return EXIT_USAGE
    except KeyboardInterrupt:
        print("navigation_server: the check was interrupted.", file=sys.stderr)
        return EXIT_FAILED
    if options.config is not None:
        argv = [*argv, "--ros-args", "--params-file", options.config]
    try:
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:
        print(f"navigation_server: {_first_line(error)}", file=sys.stderr)
        return EXIT_USAGE
    try:
        # Whoever gives a file has a vehicle of their own in mind, whatever is in the file.
        return _run(options, simulator="--params-file" not in argv)
    finally:
        rclpy.try_shutdown()


def _check(
    options: argparse.Namespace, values: dict[str, ParameterValue], ros_arguments: bool
) -> int:
    """Run ``--check`` without ROS."""
    if ros_arguments:
        raise ConfigurationError("With --check give --config and --link; it takes no --ros-args.")
    if options.config is None and options.link is None:
        values["arming"] = "auto"  # the simulator's set-up, as without --check
    config = make_config({**values, **overrides(options)})
    return run_check(config, options.timeout, options.json)


def _run(options: argparse.Namespace, simulator: bool) -> int:
    given = [Parameter(name, value=value) for name, value in overrides(options).items()]
    node = Node(SERVER_NODE_NAME, parameter_overrides=given)
    try:
        values = declare_parameters(node, simulator)
        config = make_config(values)
        signing = open_signing(config.signing_key_file, node.get_logger().warning)
        link = open_link(config.link_url, node.get_logger().info)
        recorder = None if config.record_tlog is None else TlogWriter(config.record_tlog)
    except (ConfigurationError, LinkError, OSError) as error:
        node.get_logger().fatal(str(error))
        node.destroy_node()
        return EXIT_USAGE
    clock = MonotonicClock()
    bridge = Bridge(Vehicle(config.vehicle), config.bridge)
    application = ServerApplication(bridge, recorder, clock)
    stop = threading.Event()
    codec = Codec(
        source_system=config.vehicle.source_system or 1,
        source_component=config.vehicle.source_component,
        signing=signing,
    )
    driver = Driver(application, link, codec, clock, recorder, application.fail)
    server = GoalServers(node, bridge, driver, clock)
    follow_changes(
        node, values, lambda changed: driver.post(lambda: bridge.configure(changed.bridge))
    )
    services = ServiceServers(node, bridge, driver, clock)
    application.attach(node, server, services, Topics(node, bridge, codec.statistics))
    SensorTopics(node, bridge.obstacles, driver, clock, config.bridge.obstacles)
    executor = MultiThreadedExecutor(num_threads=_EXECUTOR_THREADS)
    executor.add_node(node)
    spinner = threading.Thread(
        target=_spin, args=(executor, node, stop), name="executor", daemon=True
    )

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, on_signal)
    _say_ready(node, config)
    driver.start()
    spinner.start()
    while not stop.wait(_WATCH_PERIOD_S) and driver.running:
        pass
    gave_up = not driver.running
    if gave_up:
        node.get_logger().fatal("The driver thread has given up; the server ends.")
    _stop_goals(bridge, driver, server, clock, config)
    executor.shutdown(timeout_sec=1.0)
    # A daemon thread that the interpreter ends inside rclpy's C++ ends the process with it.
    spinner.join(_STOP_TIMEOUT_S)
    driver.stop(_STOP_TIMEOUT_S)
    node.destroy_node()
    return EXIT_FAILED if gave_up else EXIT_OK


def _stop_goals(
    bridge: Bridge,
    driver: Driver,
    server: GoalServers,
    clock: MonotonicClock,
    config: ServerConfig,
) -> None:
    """End the active goal, bringing the vehicle to a stop first; bounded in time."""
    driver.post(lambda: bridge.shut_down(clock.now()))
    pause = threading.Event()
    deadline = clock.now() + config.bridge.goto.cancel_timeout_s + 1.0
    if server.is_idle():
        return
    while not server.is_idle() and driver.running and clock.now() < deadline:
        pause.wait(0.05)
    server.abandon(OutcomeCode.INTERNAL_ERROR, "The server ended before the goal did.")
    pause.wait(_RESULT_GRACE_S)  # for the result to reach the client


def _spin(executor: MultiThreadedExecutor, node: Node, stop: threading.Event) -> None:
    """Spin until told to stop, surviving what rclpy itself lets escape.

    A KeyError can escape from an expiring goal (ros2/rclpy issues 1236, 1667); a server
    that flies a vehicle must not end because of it.
    """
    while not stop.is_set():
        try:
            executor.spin()
            return
        except ExternalShutdownException:
            stop.set()
        except Exception as error:
            node.get_logger().error(f"A ROS callback failed and was skipped: {error!r}")


def _say_ready(node: Node, config: ServerConfig) -> None:
    arming = "may arm and take off" if config.bridge.goto.may_arm else "never arms"
    node.get_logger().info(f"Navigation server ready on {config.link_url}; it {arming}")


def _first_line(error: BaseException) -> str:
    return str(error).strip().splitlines()[0] if str(error).strip() else repr(error)


if __name__ == "__main__":
    sys.exit(main())
