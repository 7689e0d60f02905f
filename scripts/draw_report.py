"""Draw docs/report.png: ``python scripts/draw_report.py [LOG]``, the report of a flight."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from flight_reports.navigation_report import main as report

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "out/demo/flight.tlog"
PICTURE = ROOT / "docs/report.png"
_SIZE = (1180, 2600)
_COLOURS = 256


def main() -> None:
    """Write the report, open it in Chromium, and keep what it shows."""
    log = Path(sys.argv[1]) if len(sys.argv) > 1 else DEMO
    with tempfile.TemporaryDirectory() as folder:
        page, shot = Path(folder, "report.html"), Path(folder, "shot.png")
        if report([str(log), "--out", str(page)]):
            sys.exit("Run `make demo` first, or name a log.")
        subprocess.run(
            [
                "chromium", "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                f"--user-data-dir={folder}/browser", "--virtual-time-budget=10000",
                f"--screenshot={shot}", f"--window-size={_SIZE[0]},{_SIZE[1]}", page.as_uri(),
            ],
            check=True,
        )  # fmt: skip
        with Image.open(shot) as image:
            image.convert("RGB").quantize(_COLOURS).save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
