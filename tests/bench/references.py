"""Programs that stand beside ours, of versions that cannot be installed beside the tests' own.

They are installed into ``out/bench_references`` when they are first needed.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

_FOLDER = Path(__file__).resolve().parents[2] / "out" / "bench_references"
# The last version with a server: newer ones are a library.
_MAVSDK = (
    "mavsdk==3.17.4 --hash=sha256:89ad14c04681b364c5a9ebe53898463b0c53d1ce70ca2eaf4fb23cac6885879b"
)
# It has no wheels, and its build asks for pip.
_PARSER = (
    "fasttlogparser==1.1.1 "
    "--hash=sha256:4883f645456c23a26e3ffe9db672579903cede1bdcc41fd86abd17ae9c234bc9"
)
_BUILD = ["pip==26.3", "pybind11==3.1.0", "scikit-build-core==1.1.2"]
_LIMIT_S = 3600.0


def mavsdk_server() -> Path | None:
    """Return the program, None with a printed sentence where it cannot be installed."""
    program = _FOLDER / "mavsdk" / "bin" / "mavsdk_server"
    if not program.exists():
        wanted = _wanted("mavsdk", _MAVSDK)
        uv = ["uv", "pip", "install", "--python", sys.executable, "--no-deps", "--require-hashes"]
        if not _run([*uv, "--target", str(_FOLDER), "-r", wanted]):
            print("mavsdk_server could not be installed: not compared.")
            return None
    program.chmod(0o755)
    return program


def fasttlogparser(build: bool) -> Path | None:
    """Return the folder that the module is in, None with a printed sentence without it.

    Args:
        build: whether to build it, which takes half a minute of processor time.
    """
    folder = _FOLDER / "parser"
    if (folder / "fasttlogparser").exists():
        return folder
    if build:
        wanted, environment = _wanted("parser", _PARSER), str(_FOLDER / "build")
        python = str(_FOLDER / "build" / "bin" / "python")
        pip = [python, "-m", "pip", "install", "--no-build-isolation", "--no-deps"]
        if (
            _run(["uv", "venv", "--clear", "--python", sys.executable, environment])
            and _run(["uv", "pip", "install", "--python", python, *_BUILD])
            and _run([*pip, "--require-hashes", "--target", str(folder), "-r", wanted])
        ):
            return folder
    print("fasttlogparser is not built: not compared.")
    return None


def _wanted(name: str, text: str) -> str:
    _FOLDER.mkdir(parents=True, exist_ok=True)
    file = _FOLDER / f"{name}.txt"
    file.write_text(text + "\n", encoding="utf-8")
    return str(file)


def _run(command: list[str]) -> bool:
    done = subprocess.run(command, capture_output=True, timeout=_LIMIT_S, check=False)
    return not done.returncode
