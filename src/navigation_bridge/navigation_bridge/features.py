"""The features of a bridge beside its goals, one line each, in the order of their objections."""

from __future__ import annotations

from navigation_bridge.requests.external_positions import ExternalPositions
from navigation_bridge.requests.feature import Feature
from navigation_bridge.requests.goal_leases import GoalLeases
from navigation_bridge.requests.goal_origins import GoalOrigins
from navigation_bridge.requests.gps_corrections import GpsCorrections
from navigation_bridge.requests.landing_targets import LandingTargets
from navigation_bridge.requests.log_requests import LogRequests
from navigation_bridge.requests.payload_requests import PayloadRequests
from navigation_bridge.requests.trajectory_commands import TrajectoryCommands
from navigation_bridge.storage.storage_requests import StorageRequests
from navigation_bridge.tasks.followed_target import FollowedTarget
from navigation_bridge.tasks.velocity_commands import VelocityCommands
from navigation_bridge.traffic.vehicle_separation import VehicleSeparation

__all__ = ["FEATURES"]

FEATURES: tuple[type[Feature], ...] = (
    StorageRequests,
    ExternalPositions,
    GoalLeases,
    GoalOrigins,
    GpsCorrections,
    LogRequests,
    PayloadRequests,
    VelocityCommands,
    TrajectoryCommands,
    FollowedTarget,
    LandingTargets,
    VehicleSeparation,
)
