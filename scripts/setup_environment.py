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
import platform
import re
import shlex
import shutil
import signal
import subprocess
import sys
import sysconfig
import time
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    Environment = Mapping[str, str]

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
INSTALL = ROOT / "install"
LOGS = ROOT / "log" / "setup"
PACKAGES_STAMP = VENV / "packages.stamp"
WORKSPACE_STAMP = INSTALL / "workspace.stamp"
# Interval of progress messages without a terminal, in seconds.
TELL_S = 15.0
# Interfaces that the wheels of ROS lack: built from definitions of our own where they are missing.
STAND_INS = ("geographic_msgs", "tf2_msgs")
# The same, but only when they are asked for: these take longer than the whole workspace.
ON_DEMAND = ("nav2_msgs",)
# Progress lines of colcon, CMake and pip.
PROGRESS = re.compile(
    r"^(?:Starting >>> (\S+)|(\[ *\d+%\])|Collecting (\S+)|(Installing collected packages))",
    re.MULTILINE,
)
OURS = (VENV, INSTALL, ROOT / "build")
ENVIRONMENT_FILE = INSTALL / "environment.bash"

# Lists separated by colons that sourcing a workspace puts entries in front of.
PATH_LISTS = (
    "AMENT_PREFIX_PATH",
    "CMAKE_PREFIX_PATH",
    "COLCON_PREFIX_PATH",
    "LD_LIBRARY_PATH",
    "PATH",
    "PKG_CONFIG_PATH",
    "PYTHONPATH",
)
# With ROS from wheels, none of these may come from outside.
FOREIGN = (
    "AMENT_PREFIX_PATH",
    "CMAKE_PREFIX_PATH",
    "COLCON_PREFIX_PATH",
    "LD_LIBRARY_PATH",
    "PYTHONHOME",
    "PYTHONPATH",
    "ROS_DISTRO",
)


class SetupError(Exception):
    """The set-up cannot continue; the message says what to do."""


def main() -> int:
    """Brings the environment up to date.

    Returns:
        0 when it is, 1 after an error, 130 when interrupted.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ros", choices=("wheels", "system"), required=True)
    parser.add_argument(
        "--with",
        dest="wanted",
        action="append",
        choices=ON_DEMAND,
        default=[],
        help="also build these interfaces, unless the sourced ROS has them",
    )
    options = parser.parse_args()
    # A signal to this process also ends its children.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    started = time.monotonic()
    try:
        with only_one_at_a_time():
            changed = update(options.ros)
            for name in options.wanted:
                changed = build_on_demand(options.ros, name) or changed
    except SetupError as error:
        print(f"Set-up failed: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nSet-up interrupted; run it again to continue.", file=sys.stderr)
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
    check_prerequisites(ros)
    where = "the sourced ROS 2 Jazzy" if ros == "system" else "ROS 2 Jazzy from pinned wheels"
    print(f"Setting up with Python {platform.python_version()} and {where}.", flush=True)
    if packages_due:
        install_packages(ros, lock)
        PACKAGES_STAMP.write_text(packages_key)
    build_workspace(ros)
    WORKSPACE_STAMP.write_text(workspace_key)
    return True


def base_interpreter() -> str:
    """The interpreter that .venv is made from, also when .venv's own one runs this."""
    path: str = sys._base_executable  # type: ignore[attr-defined]
    return os.path.realpath(path)


def key_of_packages(ros: str, lock: Path) -> str:
    """What the installed packages depend on: interpreter, place, ROS, lock and this file."""
    underlay = outside(ros).get("AMENT_PREFIX_PATH", "")
    content = hash_of([lock, Path(__file__).resolve()])
    return "\n".join([base_interpreter(), sys.version, str(ROOT), ros, underlay, content])


def workspace_inputs() -> Iterator[Path]:
    """The files whose change calls for a build. Python modules are linked, so not they."""
    for interfaces in ("custom_interfaces", *STAND_INS):
        yield from sorted((ROOT / "src" / interfaces).rglob("*"))
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
            print("Waiting for another set-up of this folder to finish.", flush=True)
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def check_prerequisites(ros: str) -> None:
    """Looks for what a package manager has to provide.

    Raises:
        SetupError: something is missing; names the Debian or Ubuntu package.
    """
    if ros == "wheels" and platform.machine() != "x86_64":
        raise SetupError(
            f"The ROS 2 wheels are made for x86-64, and this is {platform.machine()}: "
            "install ROS 2 Jazzy, source it and run this again."
        )
    for variable, default, package, what in (
        ("", "git", "git", "git"),
        ("", "make", "build-essential", "make"),
        ("CC", "cc", "build-essential", "the C compiler"),
        ("CXX", "c++", "build-essential", "the C++ compiler"),
    ):
        # Like CMake, take CC with arguments ("ccache gcc").
        command = (shlex.split(os.environ.get(variable, "")) or [default])[0]
        if shutil.which(command) is None:
            raise SetupError(f"There is no {command} ({what}): sudo apt install {package}")
    python = base_interpreter()
    # Debian's packages are named after the version when it is not the default one.
    package = Path(python).name if python.startswith("/usr/bin/") else "python3"
    if not Path(sysconfig.get_path("include"), "Python.h").is_file():
        raise SetupError(f"The headers of {python} are missing: sudo apt install {package}-dev")
    probe = [python, "-I", "-c", "import ensurepip, venv"]
    if subprocess.run(probe, stderr=subprocess.DEVNULL, check=False).returncode:
        raise SetupError(f"The venv module of {python} is missing: sudo apt install {package}-venv")


def install_packages(ros: str, lock: Path) -> None:
    """Makes a new .venv, with exactly the packages of the lock."""
    # Build results contain paths of the former environment.
    for folder in OURS:
        shutil.rmtree(folder, ignore_errors=True)
    environment = outside("wheels")
    # Packages go into .venv, regardless of the user's pip configuration.
    for variable in ("PIP_USER", "PIP_TARGET", "PIP_PREFIX", "PIP_ROOT"):
        environment.pop(variable, None)
    run("venv", "Making .venv", [base_interpreter(), "-m", "venv", VENV], environment)
    # The lock is complete, so pip has nothing to resolve.
    flags = "--no-input --no-deps --require-hashes --disable-pip-version-check"
    pip: list[str | Path] = [VENV / "bin" / "python", "-m", "pip", "install", *flags.split()]
    pip += ["--only-binary", ":all:"]
    # empy is published as source only. It is built with the pinned build tools, installed
    # first, rather than with whatever is newest on the day.
    tools = VENV / "build-tools.txt"
    tools.write_text(build_tools(lock.read_text()))
    run("build-tools", "Installing the build tools", [*pip, "-r", tools], environment)
    count = len(re.findall(r"^\S+==", lock.read_text(), re.MULTILINE))
    what = f"Installing {count} pinned packages (some minutes)"
    pip += ["--no-build-isolation", "--no-binary", "empy"]
    run("packages", what, [*pip, "-r", lock], environment)
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
    include = re.compile(r"/opt/python/[^/;\"]+/include/python3\.\d+")
    packages = re.compile(r"/opt/python/[^/;\"]+/lib/python3\.\d+/site-packages")
    for path in (VENV / "share").glob("*/cmake/*.cmake"):
        text = path.read_text()
        mended = include.sub(sysconfig.get_path("include"), text)
        mended = packages.sub(str(site_packages()), mended)
        if mended != text:
            path.write_text(mended)


def site_packages() -> Path:
    """Where the packages of .venv are."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    return VENV / "lib" / version / "site-packages"


def without_folders(environment: Environment, folders: Sequence[str | Path]) -> dict[str, str]:
    """An environment whose path lists name none of some folders, nor what is in them."""
    result = dict(environment)
    prefixes = tuple(f"{folder}/" for folder in folders)
    for variable in result.keys() & PATH_LISTS:
        entries = result[variable].split(":")
        result[variable] = ":".join(e for e in entries if not f"{e}/".startswith(prefixes))
    return result


def outside(ros: str) -> dict[str, str]:
    """This process's environment without the project: as it was before `source setup.bash`.

    With ROS from wheels, without any other ROS, too.
    """
    result = without_folders(os.environ, OURS)
    if ros == "wheels":
        result = {k: v for k, v in result.items() if k not in FOREIGN}
    return result


def base_environment(ros: str) -> dict[str, str]:
    """What the workspace is built on: ROS and .venv, entered."""
    environment = outside(ros)
    if ros == "wheels":
        environment["AMENT_PREFIX_PATH"] = str(VENV)
        environment["CMAKE_PREFIX_PATH"] = str(VENV)
        # The start-up hook of the wheels would set these by starting the interpreter twice.
        libraries = [VENV / "lib", *sorted(site_packages().glob("ros_*.libs"))]
        environment["LD_LIBRARY_PATH"] = ":".join(map(str, libraries))
        environment["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    environment["VIRTUAL_ENV"] = str(VENV)
    environment["PATH"] = f"{VENV / 'bin'}:{environment['PATH']}"
    return environment


def colcon_build(*arguments: str | Path) -> list[str | Path]:
    """The command that builds packages of this workspace."""
    command: list[str | Path] = [VENV / "bin" / "colcon", "--log-base", ROOT / "log", "build"]
    command += ["--symlink-install", "--base-paths", ROOT / "src", ROOT / "sitl"]
    command += ["--build-base", ROOT / "build", "--install-base", INSTALL]
    return [*command, "--event-handlers", "console_direct+", *arguments]


def is_provided(name: str, environment: Environment) -> bool:
    """Whether the ROS below the workspace has a package."""
    prefixes = environment["AMENT_PREFIX_PATH"].split(":")
    return any(Path(prefix, "share", name).is_dir() for prefix in prefixes)


def build_workspace(ros: str) -> None:
    """Builds all packages with colcon and records what entering the result changes."""
    WORKSPACE_STAMP.unlink(missing_ok=True)
    environment = base_environment(ros)
    skipped = [name for name in STAND_INS if is_provided(name, environment)]
    command = colcon_build("--packages-skip", *skipped, *ON_DEMAND)
    run("workspace", "Building the workspace", command, environment)
    # Else the first start compiles it; with PYTHONDONTWRITEBYTECODE set, every start does.
    command = [VENV / "bin" / "python", "-m", "compileall", "-q", ROOT / "src", ROOT / "sitl"]
    run("bytecode", "Compiling the packages", command, environment)
    record_environment(ros, environment)
    script = "source ./setup.bash && python -m drone_navigation.completion install/completion.bash"
    run("completion", "Writing what bash completes", ["bash", "-c", script], environment)


def build_on_demand(ros: str, name: str) -> bool:
    """Builds interfaces that the workspace does without, and that a rebuild of it keeps.

    Args:
        ros: "wheels" or "system".
        name: of the package.

    Returns:
        Whether there was anything to do.
    """
    environment = base_environment(ros)
    stamp = INSTALL / f"{name}.stamp"
    packages = (name, *STAND_INS)
    files = (path for each in packages for path in sorted((ROOT / "src" / each).rglob("*")))
    key = f"{read(PACKAGES_STAMP)}\n{hash_of(files)}"
    if is_provided(name, environment) or read(stamp) == key:
        return False
    stamp.unlink(missing_ok=True)
    command = colcon_build("--packages-select", name)
    run(name, f"Building {name} (one or two minutes)", command, environment)
    record_environment(ros, environment)
    stamp.write_text(key)
    return True


def record_environment(ros: str, base: dict[str, str]) -> None:
    """Writes the changes that colcon's own script makes, which `set -u` would stop."""
    script = f". {shlex.quote(str(INSTALL / 'local_setup.bash'))} && env -0"
    output = subprocess.run(["bash", "-c", script], env=base, stdout=subprocess.PIPE, check=True)
    variables = os.fsdecode(output.stdout).split("\0")
    after = dict(variable.split("=", 1) for variable in variables if "=" in variable)
    # `ros2 run` finds the executables here; this makes them commands.
    for package in ("flight_logs", "drone_navigation"):
        after["PATH"] = f"{INSTALL / package / 'lib' / package}:{after['PATH']}"
    lines = [f"# for {ros}", "# Written by scripts/setup_environment.py, read by setup.bash."]
    before = outside(ros)
    if ros == "system":
        # For shells that have not sourced this ROS.
        before = without_folders(before, before["AMENT_PREFIX_PATH"].split(":"))
        lines.append(f"export ROS_DISTRO={after['ROS_DISTRO']} ROS_VERSION=2 ROS_PYTHON_VERSION=3")
    else:
        lines.append(f"unset {' '.join(FOREIGN)}")
        lines.append("export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1")
    for variable in sorted(after.keys() & PATH_LISTS):
        known = {"", *before.get(variable, "").split(":")}
        new = [entry for entry in after[variable].split(":") if entry not in known]
        if new:
            lines.append(f"_mavbridge_prepend {variable} {shlex.quote(':'.join(new))}")
    lines.append(f"export VIRTUAL_ENV={shlex.quote(str(VENV))}")
    ENVIRONMENT_FILE.write_text("\n".join(lines) + "\n")


def progress(log: str) -> str:
    """What a step is at, by its log: the package, and how much of it has been compiled."""
    found = list(PROGRESS.finditer(log))
    return next((text.strip() for text in found[-1].groups() if text), "") if found else ""


def run(name: str, what: str, command: Sequence[str | Path], environment: dict[str, str]) -> None:
    """Runs a step, showing what it does; its output goes to a log.

    Args:
        name: the step, for the name of its log.
        what: the step, as shown to people.
        command: the program and its arguments.
        environment: the whole environment of the program.

    Raises:
        SetupError: the program failed; the end of its output was shown.
    """
    LOGS.mkdir(parents=True, exist_ok=True)
    log = LOGS / f"{name}.log"
    live = sys.stdout.isatty()
    started = time.monotonic()
    print(f"  {what} ...", end="" if live else "\n", flush=True)
    told_s, told = started, ""
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
            while process.poll() is None:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(timeout=1)
                now = time.monotonic()
                doing = progress(log.read_text(errors="replace"))
                line = f"  {what} ... {now - started:.0f} s  {doing}"
                if live:
                    width = shutil.get_terminal_size().columns - 1
                    print(f"\r{line[:width]:<{width}}", end="", flush=True)
                elif doing != told and now - told_s >= TELL_S:
                    told_s, told = now, doing
                    print(line, flush=True)
        finally:
            process.terminate()
            process.wait()
            if live:
                print(flush=True)
    if process.returncode:
        tail = log.read_text(errors="replace").splitlines()[-25:]
        print("\n".join(tail), file=sys.stderr)
        raise SetupError(
            f"'{what}' ended with code {process.returncode}; the whole output is in {log}"
        )


if __name__ == "__main__":
    sys.exit(main())
