"""The traffic as a task of one vehicle sees it. No ROS."""

from __future__ import annotations

from operator import is_

from mavlink_vehicle.positions.frames import LocalFrame
from mavlink_vehicle.profiles import Profile, VehicleKind
from navigation_bridge.configuration.settings import BridgeConfig
from navigation_bridge.requests.feature import FeatureParts
from navigation_bridge.traffic.shared_traffic import SharedTraffic
from navigation_bridge.vehicle.fence import fence_of
from navigation_bridge.vehicle.traits import drives
from navigation_core.tasks.traffic.traffic_view import TrafficFrame, TrafficView
from navigation_core.tasks.watching.plane_route import HEIGHT_ERROR_M

__all__ = ["OwnView"]

# How far a vehicle strays from its path, level and in height, its estimate's errors included.
_STRAYS_M, _RISES_M, _DRIVING_STRAYS_M = 1.0, 0.7, 1.5


class OwnView:
    """Places the shared reservations in the map of one vehicle."""

    def __init__(self, parts: FeatureParts) -> None:
        """Prepare."""
        self._parts = parts
        self._traffic_frame: tuple[object, TrafficFrame] | None = None
        self._made: tuple[tuple[object, ...], TrafficView | None] | None = None

    def of(self, shared: SharedTraffic) -> TrafficView | None:
        """Return the traffic, whoever else there is; None without a position.

        Its bounds are those of the last :meth:`renewed`.
        """
        parts = self._parts
        made_of = (shared, parts.map_frame.frame, parts.vehicle.profile, parts.config())
        if self._made is not None and all(map(is_, self._made[0], made_of)):
            return self._made[1]
        return self.renewed(shared)

    def renewed(self, shared: SharedTraffic) -> TrafficView | None:
        """Return the same with the bounds of now."""
        parts, config = self._parts, self._parts.config()
        frame, profile = parts.map_frame.frame, parts.vehicle.profile
        view = self._view(shared, frame, profile, config)
        self._made = ((shared, frame, profile, config), view)
        return view

    def _view(
        self,
        shared: SharedTraffic,
        frame: LocalFrame | None,
        profile: Profile | None,
        config: BridgeConfig,
    ) -> TrafficView | None:
        parts = self._parts
        if frame is None or profile is None or not config.traffic.on:
            return None
        if self._traffic_frame is None or self._traffic_frame[0] is not frame:
            earth = shared.frame_about(frame.origin)
            self._traffic_frame = (frame, earth.traffic_frame(parts.map_frame))
        on_ground = drives(profile)
        return TrafficView(
            reservations=shared.reservations,
            name=parts.name,
            traffic_frame=self._traffic_frame[1],
            radius_m=_DRIVING_STRAYS_M if on_ground else _STRAYS_M,
            rise_m=_RISES_M,
            heights_m=None if on_ground else self._heights_m(profile, config),
            reach_m=config.volume.radius_max_m,
            timeout_s=config.traffic.timeout_s,
            searcher=parts.searcher,
        )

    def _heights_m(self, profile: Profile, config: BridgeConfig) -> tuple[float, float]:
        """Return the lowest and highest map z of a detour, within volume and fence."""
        vehicle, map_frame = self._parts.vehicle, self._parts.map_frame
        ground_m, home = map_frame.ground_enu_m(vehicle.state), map_frame.home_enu_m(vehicle.state)
        # No detour leads lower than a take-off: near the ground it would be taken for a landing.
        low_m = ground_m + max(config.volume.altitude_min_m, config.goto.takeoff_height_m)
        high_m = ground_m + config.volume.altitude_max_m
        fence = fence_of(profile, vehicle.parameters.values, home)
        if fence is not None and home is not None:
            margin_m = config.safety.fence_margin_m
            if profile.kind is VehicleKind.PLANE:
                margin_m += HEIGHT_ERROR_M
            if fence.altitude_min_m is not None:
                low_m = max(low_m, home[2] + fence.altitude_min_m + margin_m)
            if fence.altitude_max_m is not None:
                high_m = min(high_m, home[2] + fence.altitude_max_m - margin_m)
        return low_m, max(high_m, low_m)
