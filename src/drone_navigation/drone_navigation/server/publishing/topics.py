"""Topics of the navigation server: vehicle, plan and goal events."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geographic_msgs.msg import GeoPoseStamped
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from sensor_msgs.msg import BatteryState, NavSatFix
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from custom_interfaces.msg import GoalEvent, HomePosition, VehicleStatus
from custom_interfaces.msg import GoalRejected as GoalRejectedMessage
from drone_navigation.presence import Presence
from drone_navigation.qos import LATCHED_QOS, STREAM_QOS
from drone_navigation.server.conversions import pose_stamped
from drone_navigation.server.frame_names import PLAIN, FrameNames
from drone_navigation.server.publishing import telemetry_messages as messages
from drone_navigation.server.publishing.audience import Audience
from drone_navigation.server.publishing.obstacle_grid import ObstacleGrid
from drone_navigation.server.publishing.obstacle_markers import ObstacleMarkers
from drone_navigation.server.publishing.publishing_node import PublishingNode, TopicPublisher
from drone_navigation.server.publishing.scene_topics import SceneTopics
from drone_navigation.server.publishing.transforms import Transforms, geoid_height_m
from mavlink_vehicle.io.clock import Clock
from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.state.reducer import VehicleState
from mavlink_vehicle.state.telemetry import Battery
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.server_config import PublishTf
from navigation_bridge.goals.goal import GoalHappened, GoalRejected, PlanChanged
from navigation_bridge.names import SERVER_NODE_NAME
from navigation_bridge.vehicle.link_health import LinkHealth
from navigation_bridge.vehicle.odom_frame import at_time_of_position
from navigation_bridge.vehicle.sample_times import SampleTimes
from navigation_bridge.vehicle.station_health import StationHealth

_PERIOD_S = 1.0

StationLinks: TypeAlias = Callable[[], list[tuple[str, LinkStatistics]]]


class Topics:
    """Publishers of the server; used by the driver thread only.

    Attributes:
        transforms: the tree of frames.
        diagnostics: return the state of a feature, or None without one, for a name, a hardware id
            and a time.
    """

    def __init__(
        self,
        node: PublishingNode,
        bridge: Bridge,
        statistics: Callable[[], LinkStatistics],
        frames: FrameNames = PLAIN,
        stations: StationLinks | None = None,
        presence: Presence | None = None,
        publish_tf: PublishTf = PublishTf.ALL,
        clock: Clock | None = None,
    ) -> None:
        """Advertise the topics; those without a slash are under the node's name.

        Args:
            node: who publishes.
            bridge: of the vehicle that is published.
            statistics: returns what was met on the vehicle's link.
            frames: names of the vehicle's frames.
            stations: returns URL and counts of the links to ground stations, if this is the
                one that reports them.
            presence: knows of other servers of the name; None in a bag.
            publish_tf: which transforms are published.
            clock: of the driver; None in a bag, which is written at the time of a packet.
        """
        self._clock = clock
        self._presence = presence
        self._node = node
        self._bridge = bridge
        self._statistics = statistics
        self._frames = frames
        self._name = node.get_fully_qualified_name().strip("/")
        self._health = LinkHealth()
        self._stations = stations
        self._station_health: dict[str, StationHealth] = {}
        self._seen: VehicleState | None = None
        self._status: VehicleStatus | None = None
        self._status_key: tuple[object, ...] = ()
        self._known_home: HomePosition | None = None
        self._next_s = 0.0
        self._last_rejection = node.create_publisher(String, "~/last_rejection", LATCHED_QOS)
        self._goal_rejected = node.create_publisher(
            GoalRejectedMessage, "~/goal_rejected", LATCHED_QOS
        )
        self._home = node.create_publisher(HomePosition, "~/home", LATCHED_QOS)
        self._pose = node.create_publisher(PoseStamped, "~/pose", STREAM_QOS)
        self._geo_pose = node.create_publisher(GeoPoseStamped, "~/geo_pose", STREAM_QOS)
        self._odometry = node.create_publisher(Odometry, "~/odometry", STREAM_QOS)
        self._streams = [
            (stream, Audience(stream)) for stream in (self._pose, self._odometry, self._geo_pose)
        ]
        self._fix = node.create_publisher(NavSatFix, "~/fix", STREAM_QOS)
        self._fix_audience = Audience(self._fix)
        self._battery = node.create_publisher(BatteryState, "~/battery", STREAM_QOS)
        self._batteries: dict[int, TopicPublisher] = {}
        self._plan = node.create_publisher(Path, "~/plan", LATCHED_QOS)
        self._vehicle_status = node.create_publisher(VehicleStatus, "~/vehicle_status", LATCHED_QOS)
        self._goal_events = node.create_publisher(GoalEvent, "~/goal_events", STREAM_QOS)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", STREAM_QOS)
        self._obstacles = ObstacleMarkers(
            node.create_publisher(MarkerArray, "~/obstacles", LATCHED_QOS), bridge, frames.map
        )
        self._scene = SceneTopics(node, bridge, frames.map)
        grid = node.create_publisher(OccupancyGrid, "~/obstacle_grid", LATCHED_QOS)
        self._grid = ObstacleGrid(grid, bridge, frames.map)
        self.transforms = Transforms(node, frames, publish_tf)
        self._times = SampleTimes()
        self.diagnostics: list[Callable[[str, str, float], DiagnosticStatus | None]] = []

    def begin_again(self) -> None:
        """Reset: the recording is played from its start."""
        self._health = LinkHealth()
        self._seen = self._status = self._known_home = None
        self._next_s = 0.0
        self._times = SampleTimes()
        self.transforms.begin_again()

    def publish_rejection(self, rejected: GoalRejected) -> None:
        """Publish the last rejection: as "CODE: sentence", and in fields."""
        self._last_rejection.publish(String(data=rejected.text))
        self._goal_rejected.publish(messages.goal_rejected(rejected, self._stamp()))

    def publish_plan(self, plan: PlanChanged) -> None:
        """Publish the current path; an empty one if there is none."""
        self._plan.publish(messages.path(plan.path_enu_m, self._stamp(), self._frames))

    def publish_event(self, happened: GoalHappened) -> None:
        """Publish an event of a goal."""
        message = GoalEvent(
            goal_id=happened.goal_id,
            event=happened.event,
            what=happened.what,
            message=happened.message,
        )
        message.header.stamp = self._stamp()
        self._goal_events.publish(message)

    def next_deadline(self) -> float:
        """Return the latest time of the next call of :meth:`update`."""
        return self._next_s

    def update(self, now: float) -> None:
        """Publish changes of the vehicle's state, and the rest once per second."""
        before, state = self._seen, self._bridge.vehicle.state
        periodic = now >= self._next_s
        if state is before and not periodic:
            return
        self._seen = state
        self._obstacles.update(self._stamp, now)
        self._grid.update(self._stamp, now)
        last = (None, None) if before is None else (before.global_position, before.attitude)
        for sample, known in zip((state.global_position, state.attitude), last, strict=True):
            if sample is not None and sample is not known:
                # An attitude may have come a while ago: it is published with the next position.
                self._times.observe(state.clock_count, sample.time_boot_ms, sample.time_s)
        if before is None or state.global_position is not before.global_position:
            self._publish_pose(state, now)
        if (before is None or state.gps is not before.gps) and self._fix_audience.is_there(now):
            fixed_ms = None if state.gps is None else state.gps.time_boot_ms
            measured = self._stamp() if fixed_ms is None else self._measured(fixed_ms, now)
            self._fix.publish(messages.nav_sat_fix(state, measured, self._frames))
        self._publish_batteries(before, state)
        if state.home is not None and (before is None or state.home is not before.home):
            self._publish_home(state, self._stamp())
        other_server = self._presence is not None and self._presence.other_server
        key = (other_server, *_status_key(self._bridge, state))
        if periodic or key != self._status_key:
            self._status_key = key
            self._publish_status(self._stamp(), periodic)
        if periodic:
            stamp = self._stamp()
            self._next_s = now + _PERIOD_S
            self._scene.update(stamp)
            bridge = self._bridge
            sensor = bridge.obstacles.sensor_pose
            self.transforms.publish_still(bridge.map_frame.origin, state, sensor, stamp)
            self._publish_diagnostics(stamp, now)

    def _publish_pose(self, state: VehicleState, now: float) -> None:
        heard = [stream for stream, who in self._streams if who.is_there(now)]
        if not heard and not self.transforms.are_followed(now):
            return
        pose, position = self._bridge.pose, state.global_position
        if pose is None or position is None:
            return
        pose = at_time_of_position(pose, state)
        self.transforms.follow(pose, state)
        are_heard = self.transforms.are_heard(now)
        if not heard and not are_heard:
            return
        stamp, frames = self._measured(position.time_boot_ms, now), self._frames
        if self._pose in heard:
            self._pose.publish(pose_stamped(pose, stamp, frames.map))
        if self._odometry in heard:
            self._odometry.publish(messages.odometry(pose, state, stamp, frames))
        if self._geo_pose in heard:
            geoid_m = geoid_height_m(state)
            self._geo_pose.publish(messages.geo_pose(pose, state, geoid_m, stamp, frames))
        if are_heard:
            self.transforms.publish(stamp)

    def _publish_batteries(self, before: VehicleState | None, state: VehicleState) -> None:
        """Publish the battery that decides; if there are several, also each on its own topic."""
        if before is None or state.battery is not before.battery:
            self._publish_battery(self._battery, state.battery)
        known = () if before is None else before.batteries
        if len(state.batteries) < 2 or state.batteries is known:
            return
        for battery in state.batteries:
            number = battery.battery_id
            if number not in self._batteries:
                self._batteries[number] = self._node.create_publisher(
                    BatteryState, f"~/battery_{number}", STREAM_QOS
                )
            elif battery in known:
                continue
            self._publish_battery(self._batteries[number], battery)

    def _publish_battery(self, publisher: TopicPublisher, battery: Battery | None) -> None:
        if publisher.get_subscription_count():
            publisher.publish(messages.battery_state(battery, self._stamp()))

    def _publish_home(self, state: VehicleState, stamp: Time) -> None:
        home = messages.home_position(self._bridge, state, stamp, self._frames)
        known = self._known_home
        if known is None or not messages.is_same_home(known, home):
            self._known_home = home
            self._home.publish(home)

    def _publish_status(self, stamp: Time, always: bool) -> None:
        status = messages.vehicle_status(self._bridge, stamp)
        if self._presence is not None:
            status.server_id = self._presence.own_id
            status.other_server = self._presence.other_server
        if self._status is not None:
            self._status.header.stamp = stamp
        if always or status != self._status:
            self._status = status
            self._vehicle_status.publish(status)

    def _publish_diagnostics(self, stamp: Time, now: float) -> None:
        vehicle = self._bridge.vehicle
        self._health.update(vehicle, self._statistics(), now)
        stations = []
        for url, statistics in self._stations() if self._stations else ():
            health = self._station_health.setdefault(url, StationHealth())
            health.update(statistics)
            stations.append((url, health))
        if not self._diagnostics.get_subscription_count():
            return
        message = DiagnosticArray()
        message.header.stamp = stamp
        system_id = vehicle.state.system_id
        hardware = f"system {system_id}"
        message.status = [
            messages.diagnostic(self._bridge, self._health, self._name, hardware),
            messages.obstacle_diagnostic(self._bridge, self._name, hardware, now),
            messages.loop_diagnostic(self._bridge, self._name, hardware, now),
            messages.gps_diagnostic(vehicle.state, self._name, hardware),
            messages.estimator_diagnostic(self._bridge, self._name, hardware),
            messages.battery_diagnostic(vehicle.state, self._name, hardware),
        ]
        further = (state_of(self._name, hardware, now) for state_of in self.diagnostics)
        message.status += [status for status in further if status is not None]
        for url, health in stations:
            message.status.append(messages.station_diagnostic(health, SERVER_NODE_NAME, url))
        self._diagnostics.publish(message)

    def _stamp(self) -> Time:
        return self._node.get_clock().now().to_msg()

    def _measured(self, time_boot_ms: int, now: float) -> Time:
        """Return the stamp of a sample with the vehicle's own time.

        A thread that waits for the processor publishes late; the stamp does not become later.
        """
        late_s = 0.0 if self._clock is None else self._clock.now() - now
        vehicle = self._bridge.vehicle
        age_s = vehicle.data_age.age_s(time_boot_ms, vehicle.state.clock_count, now) or 0.0
        if vehicle.data_age.keeps_our_time:
            age_s = max(age_s, self._times.age_s(time_boot_ms, now))
        now_ns = self._node.get_clock().now().nanoseconds
        # A simulated clock begins at 0, and stays there while nobody publishes it.
        measured_ns = max(now_ns - round(1e9 * (age_s + late_s)), 0)
        return Time(sec=measured_ns // 10**9, nanosec=measured_ns % 10**9)


def _status_key(bridge: Bridge, state: VehicleState) -> tuple[object, ...]:
    """Return the fields of the status that are cheap to compare."""
    vehicle = bridge.vehicle
    return (
        state.custom_mode,
        state.armed,
        state.landed_state,
        state.failsafe,
        state.texts,
        bridge.map_frame.frame is not None and state.has_pose,
        vehicle.heartbeats.alive,
        vehicle.in_control_mode,
        bridge.goals.active_id,
    )
