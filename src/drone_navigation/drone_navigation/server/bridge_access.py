"""Access of a vehicle's topics, services and actions to their server."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from rclpy.node import Node

from drone_navigation.server.frame_names import PLAIN, FrameNames
from drone_navigation.server.frames.trajectory_frames import TrajectoryFrames
from drone_navigation.server.publishing.topics import Topics
from mavlink_vehicle.io.clock import Clock
from navigation_bridge.bridge import Bridge
from navigation_bridge.configuration.make_config import ServerConfig
from navigation_bridge.fleet import DriverThread


@dataclass(frozen=True)
class BridgeAccess:
    """A vehicle's node, and the bridge behind it.

    Attributes:
        node: who offers and subscribes.
        bridge: who flies; used on the driver's thread only, unless it says otherwise.
        driver: takes work for that thread.
        clock: the bridge's time.
        config: settings of the vehicle at the start.
        topics: what is published of the vehicle; used on the driver's thread only.
        frames: names of the vehicle's frames.
        is_closed: returns whether the server is stopping.
    """

    node: Node
    bridge: Bridge
    driver: DriverThread
    clock: Clock
    config: ServerConfig
    topics: Topics
    frames: FrameNames = PLAIN
    is_closed: Callable[[], bool] = lambda: False

    @cached_property
    def trajectory_frames(self) -> TrajectoryFrames:
        """The frames of TF, for the trajectories of goals and of the topic."""
        return TrajectoryFrames(self.node, self.frames)
