"""All parameters of the navigation server, collected from the settings that declare them."""

from __future__ import annotations

from collections.abc import Iterable

from navigation_bridge.configuration.checked_values import suggestion
from navigation_bridge.configuration.declarations import ParameterSpec, specs_of
from navigation_bridge.configuration.parameter_values import ConfigurationError, ParameterValue
from navigation_bridge.configuration.server_config import ServerConfig

__all__ = [
    "PARAMETERS",
    "SERVER_WIDE",
    "SPECS",
    "ParameterSpec",
    "ParameterValue",
    "check_value",
    "unknown_parameter",
]

PARAMETERS = specs_of(ServerConfig)
SPECS = {spec.name: spec for spec in PARAMETERS}
SERVER_WIDE = frozenset(spec.name for spec in PARAMETERS if spec.server_wide)


def unknown_parameter(name: str, known: Iterable[str] = SPECS) -> ConfigurationError:
    """Return the error about an unknown parameter, with the closest name."""
    advice = suggestion(name, known) or "docs/parameters.md lists them."
    return ConfigurationError(f"There is no parameter '{name}'; {advice}")


def check_value(name: str, value: ParameterValue) -> None:
    """Check one value against its declaration.

    Raises:
        ConfigurationError: unknown name, wrong type or out of range.
    """
    if name not in SPECS:
        raise unknown_parameter(name)
    SPECS[name].check(value)
