"""Draw docs/check.svg: ``python scripts/draw_check.py``, what --check says about a simulation."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path

import yaml
from rich.console import Console

from drone_navigation.check.command import look
from drone_navigation.check.report_output import show
from drone_navigation.check.trial_flight import tried_section
from drone_navigation.processes import Process, free_udp_port
from navigation_bridge.configuration.make_config import make_config
from navigation_bridge.names import SERVER_NODE_NAME

ROOT = Path(__file__).resolve().parents[1]
SET_UP = ROOT / "bridge_config/real/ardupilot_copter.yaml"
PICTURE = ROOT / "docs/check.svg"
_LIMIT_S = 30.0


def main() -> None:
    """Start a simulated copter, look at it as at a real one, and draw the report."""
    port = free_udp_port()
    values = yaml.safe_load(SET_UP.read_text("utf-8"))[SERVER_NODE_NAME]["ros__parameters"]
    config = make_config({**values, "link_url": f"udpin://127.0.0.1:{port}"})
    link = f"udpout://127.0.0.1:{port}"
    simulator = Process("mavlink_sitl", ["python", "-m", "mavlink_sitl", "--link", link])
    try:
        report = look({"": config}, _LIMIT_S, Console(stderr=True))[""]
    finally:
        simulator.stop()
    computer = tried_section([values], print)
    report = replace(report, sections=(*report.sections, computer))
    console = Console(record=True, force_terminal=True, width=88, file=io.StringIO())
    show(report, console)
    save_svg(console, "navigation_server --check", PICTURE)


def save_svg(console: Console, title: str, picture: Path) -> None:
    """Write what a console has recorded; the picture fetches nothing: any font will do."""
    # The picture ends at the baseline of the last line; an empty line keeps descenders visible.
    console.print()
    svg = console.export_svg(title=title, unique_id=picture.stem)
    picture.write_text(re.sub(r"\s*@font-face \{.*?\}", "", svg, flags=re.DOTALL), "utf-8")


if __name__ == "__main__":
    main()
