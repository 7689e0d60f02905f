"""``make demo-agent``: an agent is rejected, proposes again, a person confirms, the vehicle flies.

Server, simulator, the process that serves the agent and the person's terminal are real; the agent
is the official client of its protocol, and follows a script. The film shows what it called and
what came back, the picture of the rehearsal, and the flight as it was recorded.
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import json
import os
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import yaml
from mcp import Client, StdioServerParameters
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from flight_reports.flight_recording import read_recording
from flight_reports.flight_video import palette
from flight_reports.pictures import scene
from flight_reports.pictures.film import Film, Playback
from tests.support.ros.ros_flight import Flight, navigate_goal
from tests.support.ros.terminal import Terminal

try:
    import imageio_ffmpeg
except ImportError:
    imageio_ffmpeg = None

ROOT = Path(__file__).resolve().parents[2]
TOKEN = "a-token-of-22-characters"
ENVELOPE = {
    "radius_m": 20, "height_min_m": 2, "height_max_m": 12, "speed_max_m_s": 4,
    "duration_max_s": 60, "battery_min_percent": 0, "clearance_min_m": 0.5,
}  # fmt: skip
FAR = {"x_m": 13.5, "y_m": 24.0, "z_m": 4.0, "speed_m_s": 3.0}
NEAR = {**FAR, "x_m": 9.0, "y_m": 16.0}
SIZE, FRAMES_HZ = (1280, 720), 8
TEXT_PX, FONT_PX, LINE_PX, COLUMNS = 520, 15, 21, 55
FLIGHT_S, LIMIT_S = 9.0, 300.0
AGENT, SERVER, PERSON = scene.TRACK, scene.INK, scene.GOOD
Picture = NDArray[np.uint8]


@dataclass
class Beat:
    """A part of the film: what is added to the text, and for how long it is then shown."""

    text: str
    colour: str
    seconds: float
    picture: Image.Image | None = None


@dataclass
class Story:
    """The events of the film, in order.

    Attributes:
        beats: before the flight, and after it.
        end: the end of the flight.
    """

    beats: list[Beat] = field(default_factory=list)
    end: Beat = field(default_factory=lambda: Beat("", SERVER, 0.0))

    def tell(self, text: str, colour: str, seconds: float, picture: Path | None = None) -> None:
        """Add a part, and print it."""
        print(text, flush=True)
        image = None if picture is None else Image.open(picture).convert("RGB")
        self.beats.append(Beat(text, colour, seconds, image))


# --- what happens ------------------------------------------------------------------------------


async def play(flight: Flight, folder: Path) -> Story:
    """Let the agent and the person act; return what happened."""
    sha = hashlib.sha256(TOKEN.encode()).hexdigest()
    rules = folder / "agents.yaml"
    rules.write_text(
        yaml.safe_dump({"agents": {"planner": {"token_sha256": sha, "envelope": ENVELOPE}}}),
        "utf-8",
    )
    environment = {**os.environ, **flight.environment, "XDG_RUNTIME_DIR": str(folder)}
    serve = ["-m", "drone_navigation.agents.navigation_mcp", "serve", "--rules", str(rules)]
    command = StdioServerParameters(
        command=sys.executable,
        args=[*serve, "--server-timeout", "60"],
        env={**environment, "NAVIGATION_MCP_TOKEN": TOKEN},
    )
    story = Story()
    async with Client(command, read_timeout_seconds=LIMIT_S) as client:
        rejected = (await _propose(client, story, FAR))["rejected"]
        limits = rejected["accepted"]["agent"]
        story.tell(f"{rejected['code']}: {rejected['message']}", scene.GOAL, 4.0)
        story.tell(f"accepted: {_short(limits)}", SERVER, 4.0)
        proposal = await _propose(client, story, NEAR)
        if "rejected" in proposal:
            raise RuntimeError(f"The second proposal was rejected, too: {proposal['rejected']}")
        drawn = (await client.call_tool("picture", {"id": proposal["id"]})).structured_content or {}
        picture = Path(drawn["picture"])
        story.tell(f"{proposal['id']}: {proposal['state']}", SERVER, 2.0, picture)
        story.tell(f"rehearsal: {_short(proposal['rehearsal'])}", SERVER, 4.5)
        await asyncio.to_thread(_confirm, story, environment, proposal["id"])
        ended = await _end(client, proposal["id"])
        story.end = Beat(f"{ended['code']}: {ended['message']}", SERVER, 3.0)
        print(story.end.text, flush=True)
        if ended["code"] != "SUCCESS":
            raise RuntimeError(story.end.text)
    return story


async def _propose(client: Client, story: Story, arguments: Mapping[str, float]) -> dict[str, Any]:
    words = ", ".join(f"{name}={value:g}" for name, value in arguments.items())
    story.tell(f"> goto({words})", AGENT, 2.0)
    result = await client.call_tool("goto", dict(arguments))
    return dict(result.structured_content or {})


async def _end(client: Client, proposal: str) -> dict[str, Any]:
    until_s = time.monotonic() + LIMIT_S
    while time.monotonic() < until_s:
        asked = {"id": proposal, "wait_s": 5}
        value = dict((await client.call_tool("proposal", asked)).structured_content or {})
        if value["state"] == "ended":
            return value
    raise RuntimeError("The flight did not end.")


def _confirm(story: Story, environment: Mapping[str, str], proposal: str) -> None:
    words = ["-m", "drone_navigation.agents.navigation_mcp", "confirm", proposal]
    terminal = Terminal(words, environment)
    try:
        terminal.wait_for("Type yes", LIMIT_S)
        story.tell(f"$ navigation_mcp confirm {proposal}", PERSON, 1.5)
        terminal.type("yes\n")
        terminal.wait(LIMIT_S)
        story.tell("Type yes to fly it: yes", PERSON, 1.5)
    finally:
        terminal.close()


def _short(values: Mapping[str, Any]) -> str:
    return json.dumps(dict(values)).replace('"', "").strip("{}")


# --- the film ----------------------------------------------------------------------------------


class Drawing:
    """Draws the pictures of the film: text beside the rehearsal or the flight."""

    def __init__(self) -> None:
        """Load the font."""
        fonts = Path(mpl.get_data_path()) / "fonts/ttf"
        self._font = ImageFont.truetype(str(fonts / "DejaVuSansMono.ttf"), FONT_PX)
        self._lines: list[tuple[str, str]] = []

    def add(self, beat: Beat) -> None:
        """Add the text of a part; the oldest lines leave at the top."""
        wrapped = textwrap.wrap(beat.text, COLUMNS, subsequent_indent="  ")
        self._lines += [("", SERVER), *((line, beat.colour) for line in wrapped)]
        self._lines = self._lines[-((SIZE[1] - 20) // LINE_PX) :]

    def picture(self, beside: Image.Image | None) -> Picture:
        """Return a picture, shape (height, width, 3)."""
        image = Image.new("RGB", SIZE, scene.PAPER)
        draw = ImageDraw.Draw(image)
        for row, (line, colour) in enumerate(self._lines):
            draw.text((12, 10 + LINE_PX * row), line, colour, self._font)
        if beside is not None:
            width = SIZE[0] - TEXT_PX
            share = min(width / beside.width, SIZE[1] / beside.height)
            fitted = beside.resize(
                (round(share * beside.width), round(share * beside.height)),
                Image.Resampling.LANCZOS,
            )
            image.paste(fitted, (TEXT_PX, (SIZE[1] - fitted.height) // 2))
        return np.asarray(image)


def pictures(story: Story, tlog: Path) -> Iterator[tuple[Picture, float]]:
    """Yield the pictures of the film, and for how many seconds each is shown."""
    drawing, beside = Drawing(), None
    for beat in story.beats:
        drawing.add(beat)
        beside = beat.picture or beside
        yield drawing.picture(beside), beat.seconds
    recording = read_recording(tlog)
    flown = recording.all_goals[-1]
    begin_s, end_s = flown.accepted_s, (flown.ended_s or recording.duration_s) + 0.5
    speedup = max((end_s - begin_s) / FLIGHT_S, 1.0)
    playback = Playback(begin_s, end_s, round(speedup, 1), FRAMES_HZ)
    for frame in Film(recording, playback.speedup).pictures(playback):
        beside = Image.fromarray(frame)
        yield drawing.picture(beside), 1.0 / FRAMES_HZ
    drawing.add(story.end)
    yield drawing.picture(beside), story.end.seconds


def write(story: Story, tlog: Path, folder: Path) -> list[Path]:
    """Write the film; return its files: a GIF, and an MP4 where there is an encoder."""
    shown = list(pictures(story, tlog))
    gif = folder / "agent.gif"
    small = [
        Image.fromarray(each).resize((960, 540), Image.Resampling.LANCZOS) for each, _ in shown
    ]
    colours = palette()
    frames = [image.quantize(palette=colours, dither=Image.Dither.NONE) for image in small]
    frames[0].save(
        gif, save_all=True, append_images=frames[1:], loop=0, optimize=True,
        duration=[round(1000 * seconds) for _, seconds in shown],
    )  # fmt: skip
    if imageio_ffmpeg is None:
        return [gif]
    mp4 = folder / "agent.mp4"
    writer = imageio_ffmpeg.write_frames(
        str(mp4), SIZE, fps=FRAMES_HZ, codec="libx264", output_params=["-crf", "27"]
    )
    writer.send(None)
    for picture, seconds in shown:
        for _ in range(max(round(seconds * FRAMES_HZ), 1)):
            writer.send(np.ascontiguousarray(picture))
    writer.close()
    return [gif, mp4]


def main() -> int:
    """Fly, and write the film; 0 if all went as in the script."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/demo-agent"), metavar="DIR")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        yard = ROOT / "bridge_config/obstacles/yard.yaml"
        flight = Flight(folder, "--ros-args", "-p", f"obstacles_file:={yard}", "--")
        try:
            print("The vehicle takes off", flush=True)
            flight.wait_for_result(flight.send(navigate_goal(0.0, 0.0, 4.0)))
            story = asyncio.run(asyncio.wait_for(play(flight, folder), LIMIT_S))
        finally:
            flight.close()
        (tlog,) = folder.glob("*.tlog")
        for path in write(story, tlog, options.out):
            print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
