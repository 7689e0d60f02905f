"""Writes the version in `VERSION` to each package: `make version`.

ROS wants it in `package.xml` and setuptools in `setup.cfg`, as text; VERSION is where it is
changed, and tests/unit/test_packaging.py holds the others equal to it. The simulator in sitl/ has
a version of its own.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def files() -> list[Path]:
    """All files that have the version."""
    folders = sorted((ROOT / "src").iterdir())
    found = [folder / name for folder in folders for name in ("package.xml", "setup.cfg")]
    return [path for path in found if path.is_file()]


def with_version(text: str, version: str) -> str:
    """The text of such a file with another version."""
    text = re.sub(r"<version>.*?</version>", f"<version>{version}</version>", text, count=1)
    return re.sub(r"^version = .*$", f"version = {version}", text, count=1, flags=re.MULTILINE)


def main() -> int:
    """Write it; 2 when VERSION holds no version."""
    version = (ROOT / "VERSION").read_text("utf-8").strip()
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        print(f"VERSION must be three numbers, such as 0.2.0, not {version!r}.", file=sys.stderr)
        return 2
    for path in files():
        text = path.read_text("utf-8")
        if with_version(text, version) != text:
            path.write_text(with_version(text, version), "utf-8")
            print(path.relative_to(ROOT))
    return 0


if __name__ == "__main__":
    sys.exit(main())
