"""Validation of single parameter values against the table. No ROS."""

from __future__ import annotations

import re
from collections.abc import Iterable

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links import LinkKind, parse_url
from navigation_bridge.configuration.parameter_table import SPECS, ParameterSpec, ParameterValue

# A token of a ROS 2 name: https://design.ros2.org/articles/topic_and_service_names.html
# ("must not start with a number", "must not contain two underscores in a row").
_TOKEN = re.compile(r"(?!.*__)[A-Za-z_][A-Za-z0-9_]*")
_NAME_LENGTH_MAX = 64


class ConfigurationError(ValueError):
    """A parameter value is invalid; the message names it and the remedy."""


def texts(value: ParameterValue) -> tuple[str, ...]:
    """Return a list without empty strings, because ROS has no empty string list."""
    return tuple(text for text in value if text) if isinstance(value, list) else ()


def unknown_parameter(name: str) -> ConfigurationError:
    """Return the error about an unknown parameter, with the closest name."""
    import difflib  # noqa: PLC0415 - for this error alone

    near = difflib.get_close_matches(name, SPECS, 1)
    advice = f"did you mean '{near[0]}'?" if near else "docs/parameters.md lists them."
    return ConfigurationError(f"There is no parameter '{name}'; {advice}")


def check_value(name: str, value: ParameterValue) -> None:
    """Check one value against its spec.

    Raises:
        ConfigurationError: unknown name, wrong type or out of range.
    """
    spec = SPECS.get(name)
    if spec is None:
        raise unknown_parameter(name)
    if isinstance(spec.default, list):
        _check_list(name, value)
    elif isinstance(spec.default, str):
        _check_text(spec, value)
    else:
        _check_number(spec, value)


def _check_list(name: str, value: ParameterValue) -> None:
    if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
        raise ConfigurationError(f"Parameter {name} must be a list of texts, not {value!r}.")
    found = texts(value)
    if name == "vehicles":
        check_vehicle_names(found)
    elif name == "gcs_links":
        _check_station_links(found)
    else:
        _check_peers(name, found)


def _check_peers(name: str, peers: Iterable[str]) -> None:
    for peer in peers:
        if any(_TOKEN.fullmatch(part) is None for part in peer.strip("/").split("/")):
            raise ConfigurationError(
                f"Parameter {name}: '{peer}' is no name of a server; give its node's name with "
                "the namespace, such as /north/navigation_server."
            )


def _check_text(spec: ParameterSpec, value: ParameterValue) -> None:
    if not isinstance(value, str):
        raise ConfigurationError(f"Parameter {spec.name} must be text, not {value!r}.")
    if spec.choices is not None and value not in spec.choices:
        raise ConfigurationError(
            f"Parameter {spec.name} is '{value}'; it must be one of {', '.join(spec.choices)}."
        )


def _check_number(spec: ParameterSpec, value: ParameterValue) -> None:
    if isinstance(value, (bool, str, list)):
        raise ConfigurationError(f"Parameter {spec.name} must be a number, not {value!r}.")
    if isinstance(spec.default, int) and not isinstance(value, int):
        raise ConfigurationError(f"Parameter {spec.name} must be a whole number, not {value!r}.")
    low, high = spec.minimum, spec.maximum
    if not (low is None or value >= low) or not (high is None or value <= high):
        raise ConfigurationError(
            f"Parameter {spec.name} is {value}; it must be between {low:g} and {high:g}."
        )


def check_vehicle_names(names: Iterable[str]) -> None:
    """Check that the names are distinct and valid ROS namespaces.

    Raises:
        ConfigurationError: a name is invalid or duplicate.
    """
    seen: set[str] = set()
    for name in names:
        if _TOKEN.fullmatch(name) is None or len(name) > _NAME_LENGTH_MAX:
            raise ConfigurationError(
                f"Parameter vehicles: '{name}' cannot be a namespace; use up to "
                f"{_NAME_LENGTH_MAX} letters, digits and single underscores, not a digit first."
            )
        if name in seen:
            raise ConfigurationError(f"Parameter vehicles names '{name}' twice.")
        seen.add(name)


def _check_station_links(urls: Iterable[str]) -> None:
    seen = set()
    for url in urls:
        try:
            link = parse_url(url)
        except LinkError as error:
            raise ConfigurationError(f"Parameter gcs_links: {error}") from error
        if link.kind is LinkKind.TLOG:
            raise ConfigurationError(
                f"Parameter gcs_links: {url} is a recording; no ground station listens there."
            )
        if link in seen:
            raise ConfigurationError(f"Parameter gcs_links names {link} twice.")
        seen.add(link)


def check_links_apart(link_url: str, station_urls: Iterable[str]) -> None:
    """Check that no ground station link is the vehicle's own link.

    Raises:
        ConfigurationError: one is.
    """
    try:
        vehicle_link = parse_url(link_url)
    except LinkError:
        return  # opening it gives a better message
    for url in station_urls:
        if parse_url(url) == vehicle_link:
            raise ConfigurationError(
                f"Parameter gcs_links: {url} is the vehicle's link (link_url); ground stations "
                "need one of their own."
            )
