"""Pictures and films of recorded flights."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from flight_logs.frames.packets import iterate_packets
from flight_reports import flight_plot, flight_video
from flight_reports.flight_recording import FlightRecording, read_recording
from flight_reports.pictures import scene as flight_scene
from flight_reports.pictures.film import Film, Picture, Playback, make_playback
from flight_reports.pictures.scene import ABOVE, Viewpoint, ground_m
from flight_reports.timeline import Timeline
from navigation_bridge.recording.recorded_notes import RecordedGoal as Goal
from navigation_core.mapping.obstacles import Box, Cylinder, Obstacles

DATA = Path(__file__).resolve().parents[2] / "data"
SIDE = Viewpoint("Side view", 0, 2)


@pytest.fixture(scope="module")
def flown() -> FlightRecording:
    """A recorded flight, with a goal and plans, and a post that is seen from 20 s to 40 s."""
    recording = read_recording(DATA / "copter_lowbatt.tlog")
    post = Obstacles.of((Cylinder("post", (20.0, 20.0), 2.0),))
    return dataclasses.replace(
        recording,
        goals=Timeline((5.0,), (Goal("a", ((10.0, 25.0, 15.0),)),)),
        plans=Timeline(
            (5.0, 30.0), (((0, 0, 15), (10, 25, 15)), ((5, 9, 15), (9, 5, 15), (10, 25, 15)))
        ),
        replans=Timeline((5.0, 30.0), (0, 1)),
        obstacles=Timeline((20.0, 40.0), (post, Obstacles())),
    )


def coloured(picture: np.ndarray[tuple[int, ...], np.dtype[np.uint8]], colour: str) -> int:
    """Return how many points of a picture have a colour, nearly."""
    wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
    return int((np.abs(picture.astype(int) - wanted).max(axis=-1) < 12).sum())


def film(recording: FlightRecording, *times_s: float) -> list[Picture]:
    pictures = Film(recording, 3.0).pictures
    # Only what is seen from above: text has edges of many colours.
    return [next(pictures(Playback(t_s, t_s, 1.0, 8.0)))[70:635, 50:720] for t_s in times_s]


def test_the_flown_path_grows(flown: FlightRecording) -> None:
    early, late = film(flown, 10.0, 50.0)
    assert coloured(early, flight_scene.TRACK) < coloured(late, flight_scene.TRACK)


def test_an_obstacle_is_drawn_when_it_is_discovered_and_pales_when_it_has_gone(
    flown: FlightRecording,
) -> None:
    before, discovered, known, gone = film(flown, 19.0, 20.1, 35.0, 41.0)
    new = [coloured(picture, flight_scene.NEW) for picture in (before, discovered, known)]
    assert new[1] > new[0] + 500
    assert new[2] < new[0] + 50
    held = [coloured(p, flight_scene.OBSTACLE) for p in (before, known, gone)]
    assert held[1] > held[0] + 500
    assert held[2] < held[0] + 50
    # In its place a paler colour, on the paper.
    assert not np.array_equal(gone, before)


def test_the_path_before_a_replan_fades(flown: FlightRecording) -> None:
    newest = Timeline(flown.plans.times_s[1:], flown.plans.values[1:])
    without = film(dataclasses.replace(flown, plans=newest), 30.2, 33.0, 36.0)
    pairs = zip(film(flown, 30.2, 33.0, 36.0), without, strict=True)
    fresh, later, gone = (int(np.abs(a.astype(int) - b).sum()) for a, b in pairs)
    assert fresh > later > gone == 0


def test_a_video_is_never_slower_than_the_flight_and_keeps_its_length(
    flown: FlightRecording,
) -> None:
    for film_s in (5.0, 24.0, 1000.0):
        playback = make_playback(flown, film_s, 8.0)
        assert playback.speedup >= 1.0
        assert len(playback.times_s()) <= 8.0 * film_s + 2
        assert playback.times_s()[-1] == playback.end_s


@pytest.mark.night
@pytest.mark.wide
def test_mp4_and_gif_show_the_same_moments(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_video, "_FILM_S", 3.0)
    log = tmp_path / "flight.tlog"
    log.write_bytes((DATA / "copter_lowbatt.tlog").read_bytes())
    assert flight_video.main([str(log), "-o", str(tmp_path / "films")]) == 0
    assert "films/flight.mp4" in capsys.readouterr().out
    with Image.open(tmp_path / "films/flight.gif") as gif:
        frames = getattr(gif, "n_frames", 1)
        assert 24 <= frames <= 32
        assert gif.size == (800, 450)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(tmp_path / "films/flight.mp4"))
    # The last picture stays a while.
    assert frames + 10 <= count <= frames + 30
    assert seconds == pytest.approx(count / 10.0, abs=0.2)


def test_without_an_encoder_only_the_gif_is_written_with_a_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flight_video, "_FILM_S", 1.0)
    monkeypatch.setattr(flight_video, "imageio_ffmpeg", None)
    assert flight_video.main([str(DATA / "copter_lowbatt.tlog"), "-o", str(tmp_path)]) == 1
    assert "imageio-ffmpeg" in capsys.readouterr().err
    assert (tmp_path / "copter_lowbatt.gif").stat().st_size > 10_000


def test_a_video_of_an_empty_recording_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert flight_video.main([]) == 1
    told = capsys.readouterr().err
    assert "out/demo/flight.tlog" in told
    assert "`make demo`" in told
    assert not list(tmp_path.iterdir())


@pytest.mark.wide_but_first
@pytest.mark.parametrize("name", ["copter_lowbatt", "rover_guided", "offboard_10m_20n_gt_api"])
def test_any_tlog_is_drawn(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "flight.png"
    assert flight_plot.main([str(DATA / f"{name}.tlog"), "-o", str(picture)]) == 0
    assert "Not in this recording: goals" in capsys.readouterr().out
    with Image.open(picture) as image:
        assert min(image.size) > 800


def test_the_folder_of_a_picture_is_made(tmp_path: Path) -> None:
    picture = tmp_path / "pictures" / "2026" / "flight.png"
    assert flight_plot.main([str(DATA / "copter_lowbatt.tlog"), "-o", str(picture)]) == 0
    assert picture.stat().st_size > 10_000


@pytest.mark.parametrize("name", ["flight.foo", "flight"])
def test_a_picture_of_no_known_format_is_an_error(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "pictures" / name
    assert flight_plot.main([str(DATA / "copter_lowbatt.tlog"), "-o", str(picture)]) == 1
    told = capsys.readouterr()
    assert f"{picture} does not end in a format of pictures: " in told.err
    assert not picture.parent.exists()
    assert not told.out


def test_a_picture_of_an_empty_recording_is_an_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert flight_plot.main([str(tmp_path / "none.tlog")]) == 1
    assert "none.tlog" in capsys.readouterr().err


def test_obstacles_have_their_outlines_in_both_views() -> None:
    both = Obstacles.of(
        (
            Cylinder("post", (3.0, 7.0), 0.5, 0.0, 4.0),
            Box("wall", (10.0, 0.0), (6.0, 2.0), np.pi / 2.0),
        )
    )
    post, wall = ABOVE.shapes(both, (0.0, 9.0))
    assert np.hypot(*(post - (3.0, 7.0)).T) == pytest.approx(0.5)
    assert wall.min(axis=0) == pytest.approx((9.0, -3.0))
    assert wall.max(axis=0) == pytest.approx((11.0, 3.0))
    post, wall = SIDE.shapes(both, (-1.0, 9.0))
    assert post.min(axis=0) == pytest.approx((2.5, 0.0))
    assert post.max(axis=0) == pytest.approx((3.5, 4.0))
    # Without an end it reaches to the edge of the picture.
    assert wall.min(axis=0) == pytest.approx((9.0, -1.0))
    assert wall.max(axis=0) == pytest.approx((11.0, 9.0))


def test_all_axes_of_a_video_are_labelled(flown: FlightRecording) -> None:
    figure = Film(flown, 3.0)._figure
    above, side = figure.axes[:2]
    assert (above.get_xlabel(), above.get_ylabel()) == ("east (m)", "north (m)")
    assert side.get_ylabel() == "altitude (m)"


def test_no_obstacle_is_drawn_below_the_ground(
    flown: FlightRecording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bottoms: list[float] = []
    shown = flight_scene.show_obstacles

    def watched(*args: Any) -> None:
        bottoms.append(args[3][0])
        shown(*args)

    monkeypatch.setattr(flight_scene, "show_obstacles", watched)
    monkeypatch.setattr(flight_plot, "read_recording", lambda *_: flown)
    flight_plot.plot_flight(tmp_path / "a.tlog", tmp_path / "a.png")
    film(flown, 25.0)
    assert ground_m(flown) == pytest.approx(0.0, abs=0.1)
    assert len(bottoms) >= 8  # gone ones and known ones, in two views, in the plot and in the film
    assert set(bottoms) == {ground_m(flown)}


def test_a_flight_is_drawn_whose_recorder_set_its_clock_back_to_1970(tmp_path: Path) -> None:
    records = list(iterate_packets(DATA / "copter_lowbatt.tlog"))
    log, half = tmp_path / "flight.tlog", len(records) // 2
    with log.open("wb") as stream:
        for number, (time_s, frame) in enumerate(records):
            stamp_us = round(1e6 * (time_s if number < half else time_s - records[half][0]))
            stream.write(stamp_us.to_bytes(8, "big") + frame)
    picture = tmp_path / "flight.png"
    assert flight_plot.main([str(log), "-o", str(picture)]) == 0
    with Image.open(picture) as drawn:
        assert drawn.size > (800, 400)
