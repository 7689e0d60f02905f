"""The features of a bridge beside its goals: one line each."""

from __future__ import annotations

from navigation_bridge.requests.feature import Feature
from navigation_bridge.requests.log_requests import LogRequests

__all__ = ["FEATURES"]

FEATURES: tuple[type[Feature], ...] = (LogRequests,)
