"""Render a video of a recorded flight: ``python -m flight_reports.flight_video LOG``."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Generator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from flight_logs.command_version import add_version
from flight_logs.extras import missing
from flight_logs.whole_file import whole_file
from flight_reports.flight_recording import NoFlightError, read_recording
from flight_reports.pictures import scene
from flight_reports.pictures.film import SIZE_PX, Film, Picture, make_playback

try:
    import imageio_ffmpeg
except ImportError:
    imageio_ffmpeg = None

EXIT_OK = 0
EXIT_FAILED = 1
_LOG = Path("out/demo/flight.tlog")
_FRAMES_HZ = 10
_FILM_S = 24.0
# How long the last picture stays.
_END_S = 2.0
_GIF_SIZE_PX = (800, 450)
# Steps from each colour to the paper, for smooth edges.
_SHADES = 4
_QUALITY = 27
_SILENT_S = 2.0
_PERIOD_S = 1.0
_NO_ENCODER = f"Only the GIF was written. {missing('imageio-ffmpeg', 'An MP4 file')}"


class VideoError(RuntimeError):
    """The video cannot be made; the text says why."""


@dataclass
class _Progress:
    """Shows progress on stderr if it takes a while."""

    clock: Callable[[], float]
    count: int
    done: int = 0

    def __post_init__(self) -> None:
        self._next_s = self.clock() + _SILENT_S

    def step(self) -> None:
        self.done += 1
        if self.clock() >= self._next_s:
            self._next_s += _PERIOD_S
            print(f"picture {self.done} of {self.count}", file=sys.stderr, flush=True)


def make_video(log: Path, mp4: Path, gif: Path, system: int | None = None) -> None:
    """Make the films of the recording at ``log``: of a vehicle's system, or of the first.

    Raises:
        NoFlightError: the recording contains no flight.
        VideoError: the MP4 cannot be written; the GIF has been.
    """
    recording = read_recording(log, system)
    playback = make_playback(recording, _FILM_S, _FRAMES_HZ)
    film = Film(recording, playback.speedup)
    progress = _Progress(time.monotonic, len(playback.times_s()))
    mp4.parent.mkdir(parents=True, exist_ok=True)
    writer = _mp4_writer(mp4)
    shown = palette()
    frames = []
    try:
        for picture in film.pictures(playback):
            small = Image.fromarray(picture).resize(_GIF_SIZE_PX, Image.Resampling.LANCZOS)
            frames.append(small.quantize(palette=shown, dither=Image.Dither.NONE))
            if writer is not None:
                writer.send(picture)
            progress.step()
        with whole_file(gif) as draft:
            _write_gif(draft, frames)
    except BaseException:
        if writer is not None:
            writer.close()
            mp4.unlink(missing_ok=True)
        raise
    if writer is None:
        raise VideoError(_NO_ENCODER)
    for _ in range(int(_END_S * _FRAMES_HZ)):
        writer.send(picture)
    writer.close()


def palette() -> Image.Image:
    """Return the colours of a GIF: those of the pictures, and what lies between them."""
    whole = np.array([to_rgb(colour) for colour in scene.COLOURS])
    share = np.linspace(1.0, 0.0, _SHADES, endpoint=False)[:, None, None]
    pale = share * whole + (1.0 - share) * np.array(to_rgb("white"))
    new, known = np.array(to_rgb(scene.NEW)), np.array(to_rgb(scene.OBSTACLE))
    ageing = share[:, 0] * new + (1.0 - share[:, 0]) * known
    papers = np.array([to_rgb("white"), to_rgb(scene.PAPER)])
    colours = np.concatenate([papers, pale.reshape(-1, 3), ageing])
    image = Image.new("P", (1, 1))
    image.putpalette([round(255.0 * part) for part in colours.ravel()])
    return image


def _write_gif(path: Path, frames: list[Image.Image]) -> None:
    duration_ms = [1000 // _FRAMES_HZ] * (len(frames) - 1) + [int(1000 * _END_S)]
    frames[0].save(
        path,
        "GIF",
        save_all=True,
        append_images=frames[1:],
        duration=duration_ms,
        loop=0,
        optimize=True,
    )


def _mp4_writer(path: Path) -> Generator[None, Picture | None, None] | None:
    """Return what takes pictures and writes them as H.264, or None without the encoder."""
    if imageio_ffmpeg is None:
        return None
    writer: Generator[None, Picture | None, None] = imageio_ffmpeg.write_frames(
        str(path), SIZE_PX, fps=_FRAMES_HZ, codec="libx264", macro_block_size=1,
        output_params=["-crf", str(_QUALITY), "-preset", "slow", "-tune", "animation",
                       "-movflags", "+faststart"],
    )  # fmt: skip
    writer.send(None)
    return writer


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of the film."""
    parser = argparse.ArgumentParser(
        prog="python -m flight_reports.flight_video",
        description="Render the flight in a tlog as MP4 and GIF.",
    )
    add_version(parser, "flight_reports")
    parser.add_argument(
        "log", type=Path, nargs="?", default=_LOG, help=f"the tlog (default: {_LOG})"
    )
    parser.add_argument(
        "-o",
        "--out",
        "--output",
        type=Path,
        metavar="DIR",
        help="output folder (default: beside the log)",
    )
    parser.add_argument("--system", type=int, metavar="ID", help="system id (default: the first)")
    return parser


def main(args: list[str] | None = None) -> int:
    """Render the videos; 0 on success."""
    options = make_parser().parse_args(args)
    folder: Path = options.out or options.log.parent
    mp4, gif = (folder / options.log.with_suffix(end).name for end in (".mp4", ".gif"))
    try:
        make_video(options.log, mp4, gif, options.system)
    except (NoFlightError, VideoError) as error:
        hint = " `make demo` records it." if options.log == _LOG and not _LOG.exists() else ""
        print(f"flight_video: {error}{hint}", file=sys.stderr)
        return EXIT_FAILED
    except OSError as error:
        print(f"flight_video: cannot write to {folder}: {error.strerror}.", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print(f"Interrupted; {mp4} and {gif} were not written.", file=sys.stderr)
        return EXIT_FAILED
    for path in (mp4, gif):
        print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")
    return EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
