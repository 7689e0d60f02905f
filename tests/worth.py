"""Measures which planted defects tests find, and in what time.

`python -m tests.worth tests/pair/test_stalls.py ...` plants the defects of tests/explore/defects.py
that these files reach, one after another and in memory only, and runs each file until a test fails.
Without a name it takes all files with slow or broad tests that start no processes:
that takes days of a core. The results are kept in out/worth.jsonl, as long as the file is the
same; `--table` only prints it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

OUT = Path("out/worth.jsonl")
_TESTS = Path(__file__).parent
_IN_ONE_PROCESS = ("fleets/", "pair/", "property/", "replay/", "unit/")
# A defect that makes tests take this many times as long is found, too.
_PATIENCE = 4.0
_PATIENCE_S = 60.0
_NOTHING_FAILED = 0


@dataclass(frozen=True)
class Worth:
    """The defects that a file of tests found.

    Attributes:
        file: from the folder of the tests on.
        digest: of its text.
        cpu_s: processor time of all its tests.
        reached: names of the defects whose statements they execute.
        found: those with which a test fails.
    """

    file: str
    digest: str
    cpu_s: float
    reached: tuple[str, ...]
    found: tuple[str, ...]


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; 0: done, 2: a file fails without a defect."""
    parser = argparse.ArgumentParser(prog="python -m tests.worth", description=__doc__)
    parser.add_argument("files", nargs="*", type=Path, help="files of tests (default: all wide)")
    parser.add_argument("--defect", action="append", help="only this one (default: all reached)")
    parser.add_argument("--table", action="store_true", help="print what was found before")
    options = parser.parse_args(arguments)
    known = load()
    for file in () if options.table else _chosen(options.files):
        before = known.get(file)
        if before is not None and before.digest == _digest(file):
            continue
        try:
            known[file] = measure(file, options.defect)
        except ValueError as error:
            print(error, file=sys.stderr)
            return 2
        if options.defect is not None:
            continue  # a part of them is not kept
        OUT.parent.mkdir(parents=True, exist_ok=True)
        with OUT.open("a", encoding="utf-8") as lines:
            lines.write(json.dumps(asdict(known[file])) + "\n")
    Console().print(table(known.values()))
    return 0


def load() -> dict[str, Worth]:
    """Return what was found before, of each file."""
    found = {}
    for line in OUT.read_text(encoding="utf-8").splitlines() if OUT.exists() else ():
        row = json.loads(line)
        row["reached"], row["found"] = tuple(row["reached"]), tuple(row["found"])
        found[row["file"]] = Worth(**row)
    return found


def measure(file: str, defects: Sequence[str] | None = None) -> Worth:
    """Run a file of tests soundly, and with each defect that it reaches.

    Args:
        file: from the folder of the tests on.
        defects: names of those that count; None: all.

    Raises:
        ValueError: a test fails without a defect.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "reached"
        failed, cpu_s = _run(file, {"REACHED": str(path)}, None)
        if failed:
            raise ValueError(f"A test of {file} fails without a defect.")
        reached = tuple(path.read_text(encoding="utf-8").splitlines())
    if defects is not None:
        reached = tuple(name for name in reached if name in defects)
    found = []
    for name in reached:
        failed, spent_s = _run(file, {"DEFECT": name}, _PATIENCE * cpu_s + _PATIENCE_S)
        print(f"{file}: {name}: {'found' if failed else 'not found'}, {spent_s:.1f} s", flush=True)
        if failed:
            found.append(name)
    return Worth(file, _digest(file), cpu_s, reached, tuple(found))


def table(worths: Iterable[Worth]) -> Table:
    """Return a row for each file; those that cost most for a defect come first."""
    rows = sorted(worths, key=_price_s, reverse=True)
    finders = Counter(name for worth in rows for name in worth.found)
    shown = Table("File", "CPU s", "Reached", "Found", "CPU s per defect", "Found by it only")
    for worth in rows:
        only = [name for name in worth.found if finders[name] == 1]
        shown.add_row(
            worth.file,
            f"{worth.cpu_s:.1f}",
            str(len(worth.reached)),
            str(len(worth.found)),
            f"{_price_s(worth):.1f}",
            ", ".join(only),
        )
    return shown


def _price_s(worth: Worth) -> float:
    return worth.cpu_s / max(len(worth.found), 1)


def _chosen(files: Sequence[Path]) -> Iterator[str]:
    if files:
        yield from (path.resolve().relative_to(_TESTS).as_posix() for path in files)
    else:
        for path in sorted(_TESTS.rglob("test_*.py")):
            file = path.relative_to(_TESTS).as_posix()
            is_wide = re.search(r"\bmark\.(wide|night)", path.read_text("utf-8")) is not None
            if is_wide and file.startswith(_IN_ONE_PROCESS):
                yield file


def _digest(file: str) -> str:
    return hashlib.sha256((_TESTS / file).read_bytes()).hexdigest()[:16]


def _run(file: str, planted: dict[str, str], limit_s: float | None) -> tuple[bool, float]:
    """Return whether a test fails, or takes too much processor time, and the time spent."""
    before = _children_s()
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "tests.planted"]
    ended = subprocess.run(
        [*command, "-p", "no:cacheprovider", str(_TESTS / file)],
        env={**os.environ, **planted},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        preexec_fn=None if limit_s is None else lambda: _limit(limit_s),
        check=False,
    )
    return ended.returncode != _NOTHING_FAILED, _children_s() - before


def _limit(limit_s: float) -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (int(limit_s), int(limit_s) + 5))


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    raise SystemExit(main())
