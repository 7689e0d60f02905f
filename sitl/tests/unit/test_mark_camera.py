"""The mark of a world, and the cameras that look for it."""

from __future__ import annotations

import math
import socket
from datetime import datetime, timezone
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import all as mav

from mavlink_sitl import (
    Mark,
    MarkCamera,
    Sighting,
    Simulation,
    VehicleConfig,
    World,
    WorldError,
    parse_world,
)
from mavlink_sitl.command_line.options import parse
from mavlink_sitl.links.addresses import LinkAddress
from sitl_support.ground_station import GroundStation
from sitl_support.programs import WAIT_S, free_udp_port, running

EXACT = MarkCamera(noise=0.0, loss=0.0, delay_s=0.0)


def above(camera: MarkCamera, mark: Mark | None = None, seed: int = 3) -> GroundStation:
    """A copter that hovers 5 m above home, nose to the East, and has seen nothing yet."""
    world = World(mark=mark or Mark((2.0, 1.0)), camera=camera)
    config = VehicleConfig(ready_after_s=1.0, heading_deg=90.0)
    station = GroundStation(Simulation([config], seed=seed, world=world)).ready().take_off(5.0)
    station.simulation.sightings()
    return station


def test_the_mark_is_seen_along_the_axes_of_the_vehicle() -> None:
    simulation = above(EXACT).simulation
    simulation.run_for(1.0)
    seen = simulation.sightings()
    assert len(seen) == 10
    north, east, down = simulation.truth.position_ned_m[0]
    # It hovers with a lean below 1 degree, and looks to the East.
    assert seen[-1].body_frd_m == pytest.approx((1.0 - east, -(2.0 - north), -down), abs=0.1)
    assert math.hypot(*seen[-1].body_frd_m) == pytest.approx(
        float(np.linalg.norm((2.0 - north, 1.0 - east, -down))), abs=0.02
    )
    assert simulation.sightings() == []


def test_a_result_comes_late_with_the_time_of_its_picture() -> None:
    prompt = above(EXACT).simulation
    late = above(MarkCamera(noise=0.0, loss=0.0, delay_s=0.3)).simulation
    for simulation in (prompt, late):
        simulation.run_for(1.0)
        simulation.sightings()
        simulation.run_for(0.1)
    (soon,), (later,) = prompt.sightings(), late.sightings()
    assert soon.measured_us - later.measured_us == 300_000
    assert late.time_us - later.measured_us >= 300_000
    late.run_for(0.3)
    assert soon in late.sightings()


@pytest.mark.parametrize(("north_m", "seen"), [(4.0, True), (6.0, False), (-6.0, False)])
def test_it_is_seen_within_the_field_of_view(north_m: float, seen: bool) -> None:
    # 45 degrees at 5 m are 5 m.
    simulation = above(EXACT, Mark((north_m, 0.0))).simulation
    simulation.run_for(1.0)
    assert bool(simulation.sightings()) == seen


@pytest.mark.night
def test_noise_and_loss_are_as_given_and_seeded() -> None:
    def seen(seed: int) -> list[Sighting]:
        simulation = above(MarkCamera(rate_hz=100.0, noise=0.02, loss=0.5), seed=seed).simulation
        simulation.run_for(0.2)
        simulation.sightings()
        found = []
        for _ in range(40):
            simulation.run_for(0.5)
            found += simulation.sightings()
        return found

    first, other = seen(3), seen(4)
    assert first == seen(3)
    assert first != other
    assert len(first) == pytest.approx(1000, abs=100)
    # It is 5.5 m away.
    spread = np.std([each.body_frd_m for each in first], axis=0)
    assert spread == pytest.approx([0.11, 0.11, 0.11], abs=0.03)


def test_a_world_without_a_mark_shows_none() -> None:
    simulation = Simulation([VehicleConfig()])
    simulation.run_for(1.0)
    assert simulation.sightings() == []


def test_a_world_file_has_the_mark_and_the_camera() -> None:
    world = parse_world("mark: {at_m: [3, -2], height_m: 1}\ncamera: {delay_s: 0.2, loss: 0}")
    assert world.mark == Mark((3.0, -2.0), 1.0)
    assert world.camera == MarkCamera(delay_s=0.2, loss=0.0)
    for text in (
        "mark: {}",
        "mark: {at_m: [1]}",
        "camera: {loss: 2}",
        "camera: {half_view_deg: 90}",
    ):
        with pytest.raises(WorldError, match=r"world:1: "):
            parse_world(text)


def test_options_put_a_mark_there() -> None:
    options, _ = parse(["--mark", "-3,2"])
    assert options.world.mark == Mark((-3.0, 2.0))
    assert options.camera == LinkAddress("udpout", "127.0.0.1", 14560)
    options, _ = parse([])
    assert (options.world.mark, options.camera) == (None, None)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("--mark 3", "write NORTH,EAST as numbers, not '3'"),
        ("--mark nan,1", "write NORTH,EAST as numbers"),
        ("--camera udpout://127.0.0.1:9", "give --mark NORTH,EAST"),
        ("--mark 1,1 --camera 14560", "is not a link"),
    ],
)
def test_a_wrong_mark_gets_one_sentence(
    words: str, sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        parse(words.split())
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1


def heard(camera: socket.socket) -> Any:
    (message,) = mav.MAVLink(None).parse_buffer(camera.recv(1000))
    return message


@pytest.mark.wide
def test_the_program_reports_the_mark_with_the_time_of_the_picture() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as camera:
        camera.bind(("127.0.0.1", 0))
        camera.settimeout(WAIT_S)
        port = camera.getsockname()[1]
        link = f"udpout://127.0.0.1:{free_udp_port()}"
        words = ["--mark", "0,0", "--camera", f"udpout://127.0.0.1:{port}", "--underway", "0,0,5"]
        with running("--link", link, *words):
            message = heard(camera)
            while message.z < 4.5:
                message = heard(camera)
            heard_us = datetime.now(tz=timezone.utc).timestamp() * 1e6
    assert (message.get_srcSystem(), message.get_srcComponent()) == (1, 100)
    assert message.frame == mav.MAV_FRAME_BODY_FRD
    assert message.position_valid == 1
    assert message.z == pytest.approx(5.0, abs=0.5)
    assert message.distance == pytest.approx(math.hypot(message.x, message.y, message.z), abs=1e-3)
    assert 0.1e6 <= heard_us - message.time_usec < WAIT_S * 1e6
