"""The links to ground stations, checked. No ROS."""

from __future__ import annotations

from collections.abc import Iterable

from mavlink_vehicle.errors import LinkError
from mavlink_vehicle.io.links import LinkKind, parse_url
from navigation_bridge.configuration.parameter_values import (
    ConfigurationError,
    ParameterValue,
    texts,
)


def read_station_links(value: ParameterValue) -> tuple[str, ...]:
    """Return the links of ``gcs_links``.

    Raises:
        ConfigurationError: one is no link, a recording, or a duplicate.
    """
    urls, seen = texts(value), set()
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
    return urls


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
