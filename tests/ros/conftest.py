"""Fixtures that fly: real processes, real UDP, real DDS."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.support.ros.ros_flight import Flight


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Flight]:
    """One vehicle and one server for a whole module; each test takes them as they are."""
    flight = Flight(tmp_path_factory.mktemp("flight"))
    yield flight
    flight.close()
