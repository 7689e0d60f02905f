"""MAVSDK's plugin for cameras, unmodified from PyPI, with the simulated vehicles.

Its plugin for gimbals does not list the servo gimbal of an ArduCopter, real or simulated: neither
has a GIMBAL_DEVICE_INFORMATION (observed with MAVSDK 4.1 and ArduCopter 4.7).
"""

from __future__ import annotations

import pytest

pytest.importorskip("mavsdk", reason="MAVSDK from PyPI is not installed")

from mavsdk.plugins.camera import Camera

from tests.interop.test_mavsdk import connected
from tests.support.stations.mavsdk_station import WAIT_S, wait, within

pytestmark = pytest.mark.wide


@pytest.mark.parametrize(
    "options", [("--param", "CAM1_TYPE=1"), ("--autopilot", "px4", "--photo-camera")]
)
def test_the_camera_is_found_and_takes_photos(options: tuple[str, ...]) -> None:
    with connected(*options) as flight:
        camera = Camera(flight.system)
        wait(lambda: bool(camera.camera_list().cameras), "a camera")
        (found,) = camera.camera_list().cameras
        # Each raises without the vehicle's consent.
        within(WAIT_S, lambda: camera.take_photo(found.component_id))
        within(WAIT_S, lambda: camera.take_photo(found.component_id))
        if "px4" in options:  # an ArduPilot's own camera driver takes single photos only
            within(WAIT_S, lambda: camera.start_photo_interval(found.component_id, 0.5))
            within(WAIT_S, lambda: camera.stop_photo_interval(found.component_id))
