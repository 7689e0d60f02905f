"""Node that replays a recording in place of a vehicle's link, with clock and services."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import ROSClock
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rosgraph_msgs.msg import Clock as ClockMessage
from std_srvs.srv import Trigger

from custom_interfaces.msg import ReplayStatus
from custom_interfaces.srv import SeekReplay
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from drone_navigation.server.vehicle_node import VehicleNode
from mavlink_vehicle.codec import Message
from mavlink_vehicle.errors import DriverError
from mavlink_vehicle.io.clock import Clock, MonotonicClock
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.io.links import LinkKind, parse_url
from navigation_bridge.configuration.make_config import ConfigurationError, ServerConfig
from navigation_bridge.fleet import FleetApplication
from navigation_bridge.recording.replay_driver import ReplayDriver, ReplayPosition
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import Rejection

_CLOCK_PERIOD_S = 0.01
_TELL_PERIOD_S = 10.0
_STATUS_PERIOD_S = 0.5


def recording_of(config: ServerConfig, vehicles: Sequence[ServerConfig]) -> str | None:
    """Return the path of the recording that is the vehicles' link; None if their link is live.

    Args:
        config: settings of the server.
        vehicles: settings of its vehicles.

    Raises:
        ConfigurationError: what cannot go together with a recording was configured.
        LinkError: a link is badly written.
    """
    links = [parse_url(vehicle.link_url) for vehicle in vehicles]
    if not any(link.kind is LinkKind.TLOG for link in links):
        return None
    if len(set(links)) > 1:
        raise ConfigurationError(
            "A recording is the link of all vehicles or of none: give all the same link_url."
        )
    if config.gcs_links:
        raise ConfigurationError(
            "Parameter gcs_links must be empty with a recording: nothing is sent."
        )
    if config.record_tlog is not None:
        raise ConfigurationError("Parameter record_tlog must be empty with a recording.")
    return links[0].path


class ReplayFleet(FleetApplication):
    """Vehicles that receive a recording."""

    def __init__(self, vehicles: Sequence[VehicleNode], clock: Clock) -> None:
        """Take the vehicles in."""
        super().__init__([vehicle.member for vehicle in vehicles], clock)
        self._vehicles = vehicles

    def take_note(self, message: Message, now: float) -> None:
        """Pass a note of the recorder to its vehicle."""
        for vehicle in self._vehicles:
            self.work(vehicle.member, partial(vehicle.outputs.take_note, message, now))

    def begin_again(self) -> None:
        """Reset."""
        for vehicle in self._vehicles:
            self.work(vehicle.member, vehicle.outputs.begin_again)

    def mute(self, muted: bool, now: float) -> None:
        """Publish nothing for a while; afterwards, everything as it then is."""
        for vehicle in self._vehicles:
            self.work(vehicle.member, partial(vehicle.outputs.mute, muted, now))


class ReplayNetwork:
    """Replacement of ``network.Network`` for a server with a recording."""

    recorder = None

    def __init__(self, driver: ReplayDriver) -> None:
        """Take the recording."""
        self.driver = driver

    def is_open(self, _url: str) -> bool:
        """A recording is always open."""
        return True

    def statistics_of(self, system_id: int) -> LinkStatistics:
        """Return the statistics of one system in the recording; of all for 0."""
        total = LinkStatistics.of(self.driver.codec.statistics)
        if system_id:
            total.lost = {who: n for who, n in total.lost.items() if who[0] == system_id}
        return total

    def station_links(self) -> list[tuple[str, LinkStatistics]]:
        """There are none."""
        return []


class ReplayNode:
    """Services, clock and log lines of a replay, on the server's node."""

    def __init__(self, root: Node, vehicles: Sequence[VehicleNode], driver: ReplayDriver) -> None:
        """Offer ``~/replay/start``, ``stop``, ``pause``, ``resume`` and ``seek``.

        Publishes ``/clock`` and ``~/replay/status``.

        Args:
            root: the server's node.
            vehicles: their clocks are the recording's from now on, and they reject goals.
            driver: what plays.
        """
        self._logger = root.get_logger()
        self._driver = driver
        self._wall = MonotonicClock()
        self._reported_s = self._wall.now()
        self._clock_unix_s = 0.0
        self._clocks = [node.get_clock() for node in (root, *(own.node for own in vehicles))]
        self._publisher = root.create_publisher(ClockMessage, "/clock", STREAM_QOS)
        for clock in self._clocks:
            assert isinstance(clock, ROSClock)
            clock._set_ros_time_is_active(True)
        self._set_time(driver.begin_unix_s)
        text = f"{driver.path} is a recording; goals need a vehicle."
        for vehicle in vehicles:
            vehicle.refuse(Rejection(OutcomeCode.NO_VEHICLE, text))
        self._status = root.create_publisher(ReplayStatus, "~/replay/status", LATCHED_QOS)
        self._status_s, self._changes = -math.inf, 0
        driver.on_time, driver.on_end = self._set_time, self._tell_end
        driver.on_look = self._look
        deeds: dict[str, tuple[Callable[[], None], str]] = {
            "start": (lambda: driver.rewind(play=True), "plays from its beginning"),
            "stop": (lambda: driver.rewind(play=False), "is stopped at its beginning"),
            "pause": (lambda: driver.pause(True), "is paused"),
            "resume": (lambda: driver.pause(False), "is resumed"),
        }
        self._services = [
            root.create_service(Trigger, f"~/replay/{name}", partial(self._serve, deed, words))
            for name, (deed, words) in deeds.items()
        ]
        self._services.append(root.create_service(SeekReplay, "~/replay/seek", self._seek))
        root.add_on_set_parameters_callback(self._on_set)
        self._logger.info(
            f"Replaying {driver.path}: nothing is sent, and goals are rejected. "
            "Control it with ~/replay/pause, resume, stop, start and seek."
        )

    # --- executor threads ----------------------------------------------------------------

    def _serve(
        self,
        deed: Callable[[], None],
        words: str,
        _request: Trigger.Request,
        response: Trigger.Response,
    ) -> Trigger.Response:
        deed()
        try:
            position = self._driver.call(self._driver.position)
        except DriverError as error:
            response.success, response.message = False, str(error)
            return response
        response.success = True
        response.message = f"The recording {words} ({_where(position)})."
        if position.ended:
            response.message = f"The recording has ended ({_where(position)})."
        return response

    def _seek(
        self, request: SeekReplay.Request, response: SeekReplay.Response
    ) -> SeekReplay.Response:
        if not (math.isfinite(request.position) and request.position >= 0.0):
            response.message = "position is not a number of seconds since the beginning."
            return response
        self._driver.seek(request.position)
        response.success = True
        response.message = f"The recording goes to {request.position:.1f} s."
        return response

    def _on_set(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name == "replay_speed":
                self._driver.set_speed(float(parameter.value))
        return SetParametersResult(successful=True)

    # --- the replay's thread -------------------------------------------------------------

    def _set_time(self, unix_s: float) -> None:
        time = Time(nanoseconds=int(unix_s * 1e9))
        for clock in self._clocks:
            clock.set_ros_time_override(time)
        if not 0.0 <= unix_s - self._clock_unix_s < _CLOCK_PERIOD_S:
            self._clock_unix_s = unix_s
            self._publisher.publish(ClockMessage(clock=time.to_msg()))
        now = self._wall.now()
        if now - self._reported_s >= _TELL_PERIOD_S:
            self._reported_s = now
            self._logger.info(f"Replay: {_where(self._driver.position())}")

    def _look(self) -> None:
        """Publish the status when it has changed, and periodically."""
        driver, now = self._driver, self._wall.now()
        if driver.changes == self._changes and now - self._status_s < _STATUS_PERIOD_S:
            return
        self._changes, self._status_s = driver.changes, now
        position = driver.position()
        message = ReplayStatus(
            position=position.recording_s,
            duration=driver.duration_s,
            speed=position.speed,
            paused=position.paused,
            ended=position.ended,
            seeking=position.seeking,
            jumps=position.jumps,
        )
        message.header.stamp = Time(nanoseconds=int(position.unix_s * 1e9)).to_msg()
        self._status.publish(message)

    def _tell_end(self) -> None:
        position = self._driver.position()
        words = [f"The recording has ended after {position.recording_s:.1f} s."]
        if position.stepped_back:
            words.append(f"Its clock was set back {position.stepped_back} times.")
        if position.shortened_s:
            words.append(f"{position.shortened_s:.0f} s of silence were skipped.")
        words.append("The last state is kept; ~/replay/start plays it again.")
        self._logger.info(" ".join(words))


def _where(position: ReplayPosition) -> str:
    return f"{position.recording_s:.1f} s, {100.0 * position.share:.0f} % of the file"
