"""What a server offers of the features of its bridges: one line each."""

from __future__ import annotations

from collections.abc import Callable

from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.logs.log_servers import LogServers

__all__ = ["FEATURE_SERVERS"]

FEATURE_SERVERS: tuple[Callable[[BridgeAccess], object], ...] = (LogServers,)
