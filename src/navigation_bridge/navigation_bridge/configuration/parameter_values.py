"""Values of parameters, and what is read from texts that need a sentence of their own. No ROS."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from typing import TypeAlias

ParameterValue: TypeAlias = bool | int | float | str | list[str]

# A token of a ROS 2 name: https://design.ros2.org/articles/topic_and_service_names.html
# ("must not start with a number", "must not contain two underscores in a row").
TOKEN = r"(?!.*__)[A-Za-z_][A-Za-z0-9_]*"
_TOKEN = re.compile(TOKEN)
_NAME_LENGTH_MAX = 64


class ConfigurationError(ValueError):
    """A parameter value is invalid; the message names it and the remedy."""


def texts(value: ParameterValue) -> tuple[str, ...]:
    """Return a list without empty strings, because ROS has no empty string list."""
    return tuple(text for text in value if text) if isinstance(value, list) else ()


def read_vehicle_names(value: ParameterValue) -> tuple[str, ...]:
    """Return the names of ``vehicles``.

    Raises:
        ConfigurationError: a name is invalid or duplicate.
    """
    names = texts(value)
    check_vehicle_names(names)
    return names


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


def read_peers(value: ParameterValue) -> tuple[str, ...]:
    """Return the names of ``traffic_peers``.

    Raises:
        ConfigurationError: one cannot be a server's name.
    """
    peers = texts(value)
    for peer in peers:
        if any(_TOKEN.fullmatch(part) is None for part in peer.strip("/").split("/")):
            raise ConfigurationError(
                f"Parameter traffic_peers: '{peer}' is no name of a server; give its node's name "
                "with the namespace, such as /north/navigation_server."
            )
    return peers


def read_origin(words: str) -> tuple[float, float, float] | None:
    """Return latitude and longitude in degrees and altitude in m; None for an empty text.

    Raises:
        ConfigurationError: the text of ``external_origin`` is no position.
    """
    return _read_position("external_origin", "above sea level", words)


def _read_position(name: str, reference: str, words: str) -> tuple[float, float, float] | None:
    if not words.strip():
        return None
    try:
        latitude_deg, longitude_deg, altitude_m = map(float, words.split())
    except ValueError:
        latitude_deg = longitude_deg = altitude_m = math.nan
    # The bounds exclude NaN as well.
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0 and abs(altitude_m) < 20e3):
        raise ConfigurationError(
            f"Parameter {name} is '{words}'; give latitude, longitude (degrees) and altitude "
            f"(metres {reference}), such as '47.3977 8.5456 488'."
        )
    return latitude_deg, longitude_deg, altitude_m


def read_operator(words: str) -> tuple[float, float, float] | None:
    """Return latitude and longitude in degrees and altitude in m; None for an empty text.

    Raises:
        ConfigurationError: the text of ``remote_id_operator_position`` is no position.
    """
    return _read_position("remote_id_operator_position", "above the WGS-84 ellipsoid", words)


def read_text(name: str, length_max: int) -> Callable[[str], str]:
    """Return the reader of a text that is sent in a field of ASCII characters.

    It raises a ConfigurationError for a longer text, or one with other characters.
    """

    def read(text: str) -> str:
        if len(text) > length_max or not (text.isascii() and (text.isprintable() or not text)):
            raise ConfigurationError(
                f"Parameter {name} is {text!r}; give at most {length_max} printable ASCII "
                "characters."
            )
        return text

    return read


def read_icao_address(digits: str) -> int:
    """Return an ICAO address; 0 for an empty text.

    Raises:
        ConfigurationError: the text of ``adsb_address`` is none.
    """
    if not digits:
        return 0
    if not re.fullmatch(r"[0-9A-Fa-f]{6}", digits) or not int(digits, 16):
        raise ConfigurationError(
            f"Parameter adsb_address is '{digits}'; give the 6 hexadecimal digits of an ICAO "
            "address, such as '4B1A2C'."
        )
    return int(digits, 16)
