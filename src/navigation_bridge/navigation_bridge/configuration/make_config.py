"""Typed, validated settings made from parameters. No ROS."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping

from navigation_bridge.configuration.declarations import make
from navigation_bridge.configuration.parameter_table import (
    PARAMETERS,
    ParameterValue,
    check_value,
)
from navigation_bridge.configuration.parameter_values import ConfigurationError
from navigation_bridge.configuration.server_config import ServerConfig
from navigation_bridge.configuration.station_links import check_links_apart

__all__ = ["ConfigurationError", "ServerConfig", "check_value", "make_config"]

# The first of each is compared with the last. With a shorter time than heartbeat_timeout_s, silence
# would be attributed to something other than a lost link.
_COMPARED: tuple[tuple[str, Callable[[float, float], bool], str, str], ...] = (
    ("volume_altitude_min_m", operator.lt, "below", "volume_altitude_max_m"),
    ("takeoff_height_min_m", operator.le, "not above", "takeoff_height_m"),
    ("speed_default_m_s", operator.le, "not above", "speed_max_m_s"),
    ("link_lost_abort_s", operator.gt, "above", "heartbeat_timeout_s"),
    ("position_timeout_s", operator.gt, "above", "heartbeat_timeout_s"),
)


def make_config(values: Mapping[str, ParameterValue]) -> ServerConfig:
    """Build the settings from parameter values; missing ones have their defaults.

    Raises:
        ConfigurationError: an unknown name, an invalid value, or contradicting values.
    """
    for given, value in values.items():
        check_value(given, value)
    merged = {spec.name: spec.default for spec in PARAMETERS}
    merged.update(values)
    numbers = {name: value for name, value in merged.items() if isinstance(value, (int, float))}
    for name, holds, words, other in _COMPARED:
        if not holds(numbers[name], numbers[other]):
            raise ConfigurationError(f"Parameter {name} must be {words} {other}.")
    if not merged["log_directory"]:
        raise ConfigurationError("Parameter log_directory must name a folder.")
    if merged["external_origin"] and not merged["external_odometry_topic"]:
        raise ConfigurationError("Parameter external_origin needs external_odometry_topic.")
    config = make(ServerConfig, merged)
    check_links_apart(config.link_url, config.gcs_links)
    if len(config.vehicles) > config.vehicles_max:
        raise ConfigurationError(
            f"{len(config.vehicles)} vehicles are configured, and this server flies at most "
            f"{config.vehicles_max} (parameter vehicles_max); run another server for the others."
        )
    return config
