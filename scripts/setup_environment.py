"""Makes the environment of the project: pinned packages in .venv, the workspace in install.

Run by setup.sh, with the interpreter that the environment is to be made from; needs nothing
but the standard library. Each of the two steps leaves a stamp as the last thing it does. A
stamp names all that the step depended on, so a step runs again when one of those changes,
and after it was interrupted.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
INSTALL = ROOT / "install"
LOGS = ROOT / "log" / "setup"
PACKAGES_STAMP = VENV / "packages.stamp"
WORKSPACE_STAMP = INSTALL / "workspace.stamp"
ENVIRONMENT_FILE = INSTALL / "environment.bash"

# Set by a sourced ROS or workspace. In a set-up from wheels none of it may come from outside.
ROS_VARIABLES = (
    "AMENT_PREFIX_PATH",
    "CMAKE_PREFIX_PATH",
    "COLCON_PREFIX_PATH",
    "LD_LIBRARY_PATH",
    "PYTHONPATH",
    "ROS_DISTRO",
    "ROS_PYTHON_VERSION",
    "ROS_VERSION",
)
# What sourcing a workspace may change, besides plain values: lists separated by colons.
PATH_VARIABLES = frozenset(ROS_VARIABLES[:5]) | {"PATH", "PKG_CONFIG_PATH"}


class SetupError(Exception):
    """The set-up cannot go on; the message says what to do."""


def main() -> int:
    """Brings the environment up to date.

    Returns:
        0 when it is, 1 after an error, 130 when interrupted.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ros", choices=("wheels", "system"), required=True)
    ros = parser.parse_args().ros
    started = time.monotonic()
    try:
        with only_one_at_a_time():
            changed = update(ros)
    except SetupError as error:
        print(f"Set-up failed: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nSet-up interrupted; run it again to go on.", file=sys.stderr)
        return 130
    if changed:
        print(f"Set-up done in {time.monotonic() - started:.0f} s.", flush=True)
    return 0


def update(ros: str) -> bool:
    """Runs the steps that are due.

    Args:
        ros: "wheels" or "system".

    Returns:
        Whether there was anything to do.
    """
    lock = ROOT / "requirements" / f"{ros}.txt"
    packages_key = key_of_packages(ros, lock)
    packages_due = read(PACKAGES_STAMP) != packages_key
    workspace_key = f"{packages_key}\n{hash_of(workspace_inputs())}"
    if not packages_due and read(WORKSPACE_STAMP) == workspace_key:
        return False
    check_prerequisites()
    where = "the sourced ROS 2 Jazzy" if ros == "system" else "ROS 2 Jazzy from pinned wheels"
    print(f"Setting up with Python {sys.version.split()[0]} and {where}.", flush=True)
    if packages_due:
        install_packages(ros, lock)
        PACKAGES_STAMP.write_text(packages_key)
    build_workspace(ros)
    WORKSPACE_STAMP.write_text(workspace_key)
    return True


def key_of_packages(ros: str, lock: Path) -> str:
    """What the installed packages depend on: interpreter, place, ROS, lock and this file."""
    interpreter = os.path.realpath(sys._base_executable)  # type: ignore[attr-defined]
    underlay = os.environ.get("AMENT_PREFIX_PATH", "") if ros == "system" else ""
    foreign = [p for p in underlay.split(":") if p and not p.startswith(str(INSTALL))]
    content = hash_of([lock, Path(__file__)])
    return "\n".join([interpreter, sys.version, str(ROOT), ros, *foreign, content])


def workspace_inputs() -> Iterator[Path]:
    """The files whose change calls for a build. Python modules are linked, so not they."""
    yield from sorted((ROOT / "src" / "custom_interfaces").rglob("*"))
    for package in sorted([*(ROOT / "src").iterdir(), ROOT / "sitl"]):
        for name in ("package.xml", "setup.py", "setup.cfg", "launch", "resource"):
            path = package / name
            yield from sorted(path.glob("*")) if path.is_dir() else [path]


def hash_of(paths: Iterable[Path]) -> str:
    """A digest of the names and contents of the files among `paths`."""
    digest = hashlib.sha256()
    for path in paths:
        if path.is_file():
            digest.update(f"{path.relative_to(ROOT)}\0".encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def read(path: Path) -> str | None:
    """The text of a file; None when it isn't there."""
    try:
        return path.read_text()
    except OSError:
        return None


@contextlib.contextmanager
def only_one_at_a_time() -> Iterator[None]:
    """Waits for another set-up of the same clone to end; the lock goes with the process."""
    descriptor = os.open(ROOT, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            print("Waiting for another set-up of this folder to end.", flush=True)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def check_prerequisites() -> None:
    """Looks for what a package manager has to provide.

    Raises:
        SetupError: something is missing; names the Debian or Ubuntu package.
    """
    for variable, command, package, what in (
        ("", "git", "git", "git"),
        ("", "make", "make", "make"),
        ("CC", "cc", "gcc", "A C compiler"),
        ("CXX", "c++", "g++", "A C++ compiler"),
    ):
        # CC may carry arguments ("ccache gcc"), as it may for CMake.
        named = shlex.split(os.environ.get(variable, "")) if variable else []
        if shutil.which(named[0] if named else command) is None:
            name = f" ({variable}={os.environ[variable]})" if named else ""
            raise SetupError(f"{what}{name} is missing: sudo apt install {package}")
    version = f"{sys.version_info.major}.{sys.version_info.minor}"
    python = os.path.realpath(sys._base_executable)  # type: ignore[attr-defined]
    prefix = f"python{version}" if python.startswith("/usr/bin/") else "python3"
    if not Path(sysconfig.get_path("include"), "Python.h").is_file():
        raise SetupError(
            f"The headers of {python} are missing: sudo apt install {prefix}-dev"
        )
    probe = [python, "-I", "-c", "import ensurepip, venv"]
    if subprocess.run(probe, stderr=subprocess.DEVNULL, check=False).returncode:
        raise SetupError(
            f"The venv module of {python} is missing: sudo apt install {prefix}-venv"
        )


def install_packages(ros: str, lock: Path) -> None:
    """Makes .venv anew, with exactly the packages of the lock."""
    # What was built with the old environment names its paths.
    for folder in (VENV, INSTALL, ROOT / "build"):
        shutil.rmtree(folder, ignore_errors=True)
    python = os.path.realpath(sys._base_executable)  # type: ignore[attr-defined]
    environment = clean_environment()
    run("Making .venv", [python, "-m", "venv", VENV], environment)
    venv_python = VENV / "bin" / "python"
    pip = [venv_python, "-m", "pip", "install", "--quiet", "--require-hashes", "--no-input"]
    pip += ["--disable-pip-version-check"]
    # The few packages that are published as source are built with the pinned build tools,
    # not with whatever is newest on the day. Those tools come first.
    tools = VENV / "build-tools.txt"
    tools.write_text(build_tools(lock.read_text()))
    binary = [*pip, "--only-binary", ":all:", "-r", tools]
    run("Installing the build tools", binary, environment)
    count = len(re.findall(r"^\S+==", lock.read_text(), re.MULTILINE))
    everything = [*pip, "--no-build-isolation", "--prefer-binary", "-r", lock]
    run(f"Installing {count} pinned packages", everything, environment)
    if ros == "wheels":
        mend_cmake_files()


def build_tools(lock: str) -> str:
    """The part of a lock that building a package from source needs."""
    blocks = re.split(r"\n(?=\S)", lock)
    return "\n".join(b for b in blocks if re.match(r"(setuptools|wheel|packaging)==", b))


def mend_cmake_files() -> None:
    """Points the CMake files of the ROS wheels at this environment.

    They name the include folders of the machine that the wheels were built on, and CMake
    stops at folders that don't exist.
    """
    major_minor = f"python{sys.version_info.major}.{sys.version_info.minor}"
    include = re.compile(r"/opt/python/[^/;\"]+/include/python3\.\d+")
    packages = re.compile(r"/opt/python/[^/;\"]+/lib/python3\.\d+/site-packages")
    site_packages = VENV / "lib" / major_minor / "site-packages"
    for path in (VENV / "share").glob("*/cmake/*.cmake"):
        text = path.read_text()
        mended = include.sub(sysconfig.get_path("include"), text)
        mended = packages.sub(str(site_packages), mended)
        if mended != text:
            path.write_text(mended)


def clean_environment() -> dict[str, str]:
    """The environment for pip: nothing that adds packages from elsewhere."""
    unwanted = {*ROS_VARIABLES, "PYTHONHOME", "PIP_USER", "PIP_TARGET", "PIP_PREFIX", "VIRTUAL_ENV"}
    environment = {k: v for k, v in os.environ.items() if k not in unwanted}
    environment["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    return environment


def base_environment(ros: str) -> dict[str, str]:
    """The environment that the workspace is built in, without the workspace itself."""
    environment = dict(os.environ)
    environment.pop("PYTHONHOME", None)
    if ros == "wheels":
        environment = clean_environment()
        site_packages = next((VENV / "lib").glob("python3.*/site-packages"))
        libraries = [VENV / "lib", *sorted(site_packages.glob("ros_*.libs"))]
        environment["AMENT_PREFIX_PATH"] = str(VENV)
        environment["CMAKE_PREFIX_PATH"] = str(VENV)
        # The wheels' own start-up hook would set this by running the interpreter twice.
        environment["LD_LIBRARY_PATH"] = ":".join(map(str, libraries))
    for variable in PATH_VARIABLES & environment.keys():
        entries = environment[variable].split(":")
        ours = (str(VENV), str(INSTALL), str(ROOT / "build"))
        kept = [e for e in entries if not (e.startswith(ours) and variable == "PATH")]
        if ros == "system":
            kept = [e for e in entries if not e.startswith(ours)]
        environment[variable] = ":".join(kept)
    environment["VIRTUAL_ENV"] = str(VENV)
    environment["PATH"] = f"{VENV / 'bin'}:{environment['PATH']}"
    return environment


def build_workspace(ros: str) -> None:
    """Builds all packages with colcon and records what sourcing the result changes."""
    WORKSPACE_STAMP.unlink(missing_ok=True)
    environment = base_environment(ros)
    command = [VENV / "bin" / "colcon", "--log-base", ROOT / "log", "build", "--symlink-install"]
    command += ["--base-paths", ROOT / "src", ROOT / "sitl"]
    command += ["--build-base", ROOT / "build", "--install-base", INSTALL]
    command += ["--event-handlers", "console_direct+", "--cmake-args", "-DBUILD_TESTING=OFF"]
    command += ["--no-warn-unused-cli"]
    run("Building the workspace", command, environment)
    record_environment(ros, environment)


def record_environment(ros: str, base: dict[str, str]) -> None:
    """Writes the change that colcon's setup.bash makes, so that entering it costs no time."""
    script = f". {shlex.quote(str(INSTALL / 'local_setup.bash'))} && env -0"
    output = subprocess.run(
        ["bash", "-c", script], env=base, capture_output=True, text=True, check=True
    ).stdout
    after = dict(line.split("=", 1) for line in output.split("\0") if "=" in line)
    after["PATH"] = f"{INSTALL / 'drone_navigation/lib/drone_navigation'}:{after['PATH']}"
    reference = clean_environment() if ros == "wheels" else without_ours(dict(os.environ))
    lines = [
        "# Written by scripts/setup_environment.py; read by setup.bash. Don't edit.",
        f"_mavbridge_kind={ros}",
    ]
    if ros == "wheels":
        lines += [f"unset {' '.join(ROS_VARIABLES)}", "export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1"]
    for variable in sorted(PATH_VARIABLES & after.keys()):
        known = set(reference.get(variable, "").split(":"))
        new = [entry for entry in after[variable].split(":") if entry and entry not in known]
        if new:
            lines.append(f"_mavbridge_prepend {variable} {shlex.quote(':'.join(new))}")
    lines.append(f"export VIRTUAL_ENV={shlex.quote(str(VENV))}")
    ENVIRONMENT_FILE.write_text("\n".join(lines) + "\n")


def without_ours(environment: dict[str, str]) -> dict[str, str]:
    """An environment without what a former `source setup.bash` of this folder added."""
    for variable in PATH_VARIABLES & environment.keys():
        entries = environment[variable].split(":")
        environment[variable] = ":".join(e for e in entries if not e.startswith(str(ROOT)))
    return environment


def run(what: str, command: list[str | Path], environment: dict[str, str]) -> None:
    """Runs a step, showing what it does; its output goes to a log.

    Args:
        what: the step, as shown to people.
        command: the program and its arguments.
        environment: the whole environment of the program.

    Raises:
        SetupError: the program failed; the end of its output was shown.
    """
    LOGS.mkdir(parents=True, exist_ok=True)
    log = LOGS / f"{re.sub(r'[^a-z]+', '-', what.lower()).strip('-')}.log"
    started = time.monotonic()
    terminal = sys.stdout.isatty()
    print(f"  {what} ...", end="" if terminal else "\n", flush=True)
    with log.open("w") as output:
        process = subprocess.Popen(
            list(map(str, command)),
            env=environment,
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
        )
        try:
            while True:
                try:
                    code = process.wait(timeout=1)
                    break
                except subprocess.TimeoutExpired:
                    if terminal:
                        seconds = time.monotonic() - started
                        print(f"\r  {what} ... {seconds:.0f} s", end="", flush=True)
        except BaseException:
            process.terminate()
            process.wait()
            raise
    if terminal:
        print(f"\r  {what} ... {time.monotonic() - started:.0f} s")
    if code:
        tail = "\n".join(log.read_text(errors="replace").splitlines()[-25:])
        print(tail, file=sys.stderr)
        raise SetupError(f"'{what}' ended with code {code}; the whole output is in {log}")


if __name__ == "__main__":
    sys.exit(main())
