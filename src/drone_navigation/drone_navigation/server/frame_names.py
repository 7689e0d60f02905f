"""Names of a vehicle's frames. No ROS."""

from __future__ import annotations

from dataclasses import dataclass

from navigation_bridge.names import FRAME_BASE_LINK, FRAME_MAP, FRAME_ODOM

FRAME_EARTH = "earth"
"""Earth-centred, earth-fixed: one for all vehicles."""

_FRAME_GPS = "gps"


@dataclass(frozen=True)
class FrameNames:
    """Frames of REP 105 for one of several vehicles, each with a map of its own.

    The map's origin is the vehicle's, so that two vehicles share no map; as ``/tf`` is one for
    all, the names differ.

    Attributes:
        prefix: the vehicle's namespace and a slash; empty for a vehicle without one.
    """

    prefix: str = ""

    @classmethod
    def of(cls, namespace: str) -> FrameNames:
        """Return the names for a node's namespace."""
        name = namespace.strip("/")
        return cls(f"{name}/" if name else "")

    @property
    def map(self) -> str:
        """ENU metres from the vehicle's local origin."""
        return self.prefix + FRAME_MAP

    @property
    def odom(self) -> str:
        """The frame in which the vehicle never jumps."""
        return self.prefix + FRAME_ODOM

    @property
    def base_link(self) -> str:
        """FLU metres from the vehicle."""
        return self.prefix + FRAME_BASE_LINK

    @property
    def gps(self) -> str:
        """Frame of the GPS antenna."""
        return self.prefix + _FRAME_GPS

    def is_own(self, frame_id: str) -> bool:
        """Return whether a name is that of one of these frames."""
        return frame_id in (FRAME_EARTH, self.map, self.odom, self.base_link, self.gps)

    def plain(self, frame_id: str) -> str:
        """Return a name without the prefix, which is optional in goals."""
        return frame_id.removeprefix(self.prefix)


PLAIN = FrameNames()
