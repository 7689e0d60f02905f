"""Cross-checked settings of a server's vehicles. No ROS."""

from __future__ import annotations

from collections.abc import Mapping

from navigation_bridge.configuration.make_config import ServerConfig, make_config
from navigation_bridge.configuration.parameter_table import SERVER_WIDE, ParameterValue
from navigation_bridge.configuration.parameter_values import ConfigurationError
from navigation_bridge.configuration.station_links import check_links_apart


def make_vehicle_configs(
    vehicles: Mapping[str, Mapping[str, ParameterValue]],
) -> dict[str, ServerConfig]:
    """Build the settings of each of several vehicles.

    Args:
        vehicles: parameter values by vehicle name.

    Raises:
        ConfigurationError: values that are invalid, or that two vehicles cannot share.
    """
    configs = {name: make_vehicle_config(name, values) for name, values in vehicles.items()}
    check_fleet(configs)
    return configs


def make_vehicle_config(name: str, values: Mapping[str, ParameterValue]) -> ServerConfig:
    """Build the settings of one of several vehicles.

    Raises:
        ConfigurationError: as :func:`make_config` does, with the vehicle's name.
    """
    try:
        return make_config(values)
    except ConfigurationError as error:
        raise ConfigurationError(f"Vehicle {name}: {error}") from error


def check_server_wide(
    name: str, own: Mapping[str, ParameterValue], server: Mapping[str, ParameterValue]
) -> None:
    """Check that no vehicle sets a parameter of the server as a whole.

    Raises:
        ConfigurationError: it does.
    """
    for parameter in sorted(SERVER_WIDE & set(own)):
        # Values for all nodes, as by -p, also reach the vehicles' nodes.
        if own[parameter] != server.get(parameter):
            raise ConfigurationError(
                f"Vehicle {name}: parameter {parameter} belongs to the server; set it on the node "
                "/navigation_server."
            )


def check_fleet(configs: Mapping[str, ServerConfig]) -> None:
    """Check that several vehicles have distinct system ids.

    Raises:
        ConfigurationError: two have the same system id, or one of several has none.
    """
    systems: dict[int, str] = {}
    for name, config in configs.items():
        system_id = config.vehicle.target_system
        if system_id == 0 and len(configs) > 1:
            raise ConfigurationError(
                f"Vehicle {name}: parameter target_system is 0; with several vehicles each needs "
                "its own MAVLink system id."
            )
        if system_id in systems:
            raise ConfigurationError(
                f"Vehicles {systems[system_id]} and {name} have the same target_system, "
                f"{system_id}; each vehicle of a server needs its own system id."
            )
        systems[system_id] = name
        check_links_apart(config.link_url, config.gcs_links)
