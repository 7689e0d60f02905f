"""Tries the packages that need no ROS on ARM64, on a machine of another kind: `make test-arm64`.

An ARM64 Debian (or Ubuntu) of this machine's release is unpacked into out/arm64, without
privileges, and qemu runs its Python. The lock beside a sourced ROS is installed as on ARM64 by the
set-up's own function; what has no wheel is built by a cross compiler. Then run the unit tests of
the packages that need no ROS, some flights in simulated time, and the wheels.

The kernel of this machine cannot start ARM64 programs, so `python` is a script that starts qemu,
and the compiler, CMake and Ninja are programs of this machine.
"""

from __future__ import annotations

import argparse
import os
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import setup_environment
from setup_environment import ROOT, SetupError

FOLDER = ROOT / "out" / "arm64"
DEBIAN = FOLDER / "debian"
"""The unpacked ARM64 system"""
TOOLS = FOLDER / "tools"
"""Programs of this machine that are not installed on it"""
BUILD_TOOLS = FOLDER / "build_tools"
"""CMake and Ninja, as pinned"""
COMMANDS = FOLDER / "commands"
KERNELS = FOLDER / "kernels"
"""The package navigation_kernels with its library"""
VENV = FOLDER / "venv"
LOGS_NAMED = "arm64"
QEMU = "qemu-aarch64-static"
CROSS = "aarch64-linux-gnu-"
IN_DEBIAN = ("python3", "python3-dev", "libstdc++6")
ON_THIS_MACHINE = ("qemu-user-static", "g++-aarch64-linux-gnu")
TESTING = (
    "exceptiongroup", "execnet", "hypothesis", "iniconfig", "lxml", "pip", "pluggy", "psutil",
    "pytest", "pytest-timeout", "pytest-xdist", "setuptools", "sortedcontainers", "tomli", "wheel",
)  # fmt: skip
"""What the tests need of the packages for development"""
UNIT_TESTS = ("tests/unit/core", "tests/unit/vehicle", "tests/unit/logs", "sitl/tests/unit")
FLIGHTS = (
    "test_goal_life_cycle.py::test_from_the_ground_to_the_target",
    "test_goal_life_cycle.py::test_a_replaced_goal_ends_preempted_without_stop_or_gap",
    "test_goal_life_cycle.py::test_the_pilot_wins_and_the_server_falls_silent[LOITER-TAKING_OFF]",
    "test_goal_life_cycle.py::test_silence_is_reported_then_ends_the_goal_and_is_not_revived",
    "test_px4_goals.py::test_a_goal_is_flown_from_the_ground_and_left_in_hold",
    "test_px4_goals.py::test_take_off_land_and_return",
    "test_ground_goals.py::test_a_route_is_driven_without_a_stop[rover ardupilot]",
    "test_ground_goals.py::test_a_route_is_driven_without_a_stop[boat px4]",
    "test_plane_goals.py::test_a_goal_takes_off_flies_there_and_circles[ardupilot]",
    "test_plane_goals.py::test_a_goal_takes_off_flies_there_and_circles[px4]",
    "test_obstacle_flights.py::test_who_is_walled_in_is_blocked_says_so_and_ends_with_no_path",
    "test_routes.py::test_waypoints_are_flown_through_without_a_stop",
    (
        "test_missions.py::"
        "test_a_copter_on_the_ground_takes_off_and_flies_its_mission_to_the_end[ardupilot]"
    ),
)
"""Of tests/pair: each kind of vehicle and firmware, obstacles, routes, missions, faults"""


def main() -> int:
    """Set up and run; the exit code is 0 when all passed, 1 when a test failed, 2 without a try."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "tests", nargs="*", help="these alone, and options of pytest (default: all that is here)"
    )
    options, of_pytest = parser.parse_known_args()
    try:
        set_up()
    except (SetupError, OSError) as error:
        print(f"ARM64 could not be tried: {error}", file=sys.stderr)
        return 2
    flights = [f"tests/pair/{name}" for name in FLIGHTS]
    parts = (
        [options.tests + of_pytest]
        if options.tests
        else [[name] for name in UNIT_TESTS] + [flights]
    )
    passed = [run_tests(paths) for paths in parts]
    if not options.tests:
        passed += [set_up_names_the_remedy(), wheels_work()]
    return int(not all(passed))


def set_up() -> None:
    """Unpack and install what is not there yet.

    Raises:
        SetupError: something is missing or cannot be downloaded; names it.
    """
    if platform.machine() == "aarch64":
        raise SetupError("this machine is one, so 'make test' tries it")
    for command in ("apt-get", "dpkg-deb"):
        if shutil.which(command) is None:
            raise SetupError(f"there is no {command}, which comes with Debian and Ubuntu")
    FOLDER.mkdir(parents=True, exist_ok=True)
    if shutil.which(QEMU) is None or shutil.which(f"{CROSS}g++") is None:
        unpack(ON_THIS_MACHINE, None, TOOLS)
    unpack(IN_DEBIAN, "arm64", DEBIAN)
    write_commands()
    locks = [setup_environment.lock_of("system", layer) for layer in ("extras", "dev", "build")]
    stamp = FOLDER / "venv.stamp"
    key = f"{setup_environment.hash_of(locks)} {' '.join(TESTING)}"
    if setup_environment.read(stamp) != key:
        stamp.unlink(missing_ok=True)
        install(locks)
        stamp.write_text(key)
    build_kernels()


def unpack(packages: Sequence[str], architecture: str | None, folder: Path) -> None:
    """Unpack packages of Debian and what they depend on, once; nothing is installed.

    Args:
        packages: their names.
        architecture: as Debian names it; None for this machine's, less what is installed on it.
        folder: where to.
    """
    stamp = folder.with_suffix(".stamp")
    if setup_environment.read(stamp) == " ".join(packages):
        return
    shutil.rmtree(folder, ignore_errors=True)
    apt = FOLDER / f"apt_{folder.name}"
    for name in ("lists/partial", "cache/archives/partial"):
        (apt / name).mkdir(parents=True, exist_ok=True)
    command = ["apt-get", "-q", "-y", f"-oDir::State::lists={apt}/lists"]
    command += [f"-oDir::Cache={apt}/cache", "-oDebug::NoLocking=1"]
    if os.getuid() == 0:
        # apt-get downloads as a user that may not write here.
        command += ["-oAPT::Sandbox::User=root"]
    if architecture is not None:
        (apt / "status").touch()
        command += [f"-oAPT::Architecture={architecture}", f"-oAPT::Architectures={architecture}"]
        command += [f"-oDir::State::status={apt}/status"]
    what = f"{architecture or 'this machine'}: {', '.join(packages)}"
    step("lists", f"Reading the package lists for {what}", [*command, "update"])
    command += ["install", "--download-only", "--no-install-recommends", *packages]
    step("download", f"Downloading for {what}", command)
    folder.mkdir()
    # As on a system of today; archives may have /lib, or /usr/lib in its place.
    for name in ("bin", "lib", "sbin"):
        (folder / "usr" / name).mkdir(parents=True)
        (folder / name).symlink_to(f"usr/{name}")
    script = 'for each; do dpkg-deb --fsys-tarfile "$each" | tar -x --no-same-owner '
    script += f"--keep-directory-symlink -C {folder}; done"
    archives = sorted(apt.glob("cache/archives/*.deb"))
    command = ["bash", "-euo", "pipefail", "-c", script, "bash", *map(str, archives)]
    step("unpack", f"Unpacking {len(archives)} packages", command)
    shutil.rmtree(apt)
    stamp.write_text(" ".join(packages))


def write_commands() -> None:
    """Write what starts the Python of the ARM64 system, and the compilers for it."""
    COMMANDS.mkdir(exist_ok=True)
    qemu = shutil.which(QEMU) or TOOLS / "usr/bin" / QEMU
    (python,) = (path for path in DEBIAN.glob("usr/bin/python3.*") if path.suffix[1:].isdigit())
    # Python finds its environment by the name that it was called by.
    executable(DEBIAN / "usr/bin/python", f'exec {qemu} -L {DEBIAN} -0 "$0" {python} "$@"')
    for name in ("gcc", "g++"):
        installed = shutil.which(f"{CROSS}{name}")
        headers = f'-idirafter {DEBIAN}/usr/include "$@"'
        if installed:
            executable(COMMANDS / name, f"exec {installed} {headers}")
            continue
        libraries = ":".join(map(str, TOOLS.glob("usr/lib/*-linux-gnu")))
        compiler = f"{TOOLS}/usr/bin/{CROSS}{name} --sysroot={TOOLS}"
        executable(COMMANDS / name, f"LD_LIBRARY_PATH={libraries} exec {compiler} {headers}")


def executable(path: Path, line: str) -> None:
    """Write a script of one line."""
    path.unlink(missing_ok=True)
    path.write_text(f"#!/bin/sh\n{line}\n")
    path.chmod(0o755)


def install(locks: Sequence[Path]) -> None:
    """Install the packages of the locks (extras, dev, build), as the set-up does on ARM64."""
    extras, dev, build = locks
    native = [setup_environment.base_interpreter(), "-m", "venv", "--clear", "--without-pip"]
    step("venv", "Making environments", [*native, str(BUILD_TOOLS)])
    python = str(DEBIAN / "usr/bin/python")
    step("venv", "Making environments", [python, *native[1:], str(VENV)])
    chosen = FOLDER / "chosen.txt"
    chosen.write_text(setup_environment.blocks_of(build, "cmake", "ninja"))
    setup_environment.install_lock(chosen, BUILD_TOOLS)
    os.environ["CC"], os.environ["CXX"] = str(COMMANDS / "gcc"), str(COMMANDS / "g++")
    path = os.environ["PATH"]
    # The cached answer of the set-up's installer has the environment of the time before.
    setup_environment.installer.cache_clear()
    os.environ["PATH"] = f"{BUILD_TOOLS / 'bin'}:{path}"
    setup_environment.install_lock(extras, VENV)
    chosen.write_text(setup_environment.blocks_of(dev, *TESTING))
    setup_environment.install_lock(chosen, VENV)
    os.environ["PATH"] = path


def build_kernels() -> None:
    """Build navigation_kernels by the cross compiler, as the set-up does, if it has changed."""
    stamp = FOLDER / "kernels.stamp"
    key = setup_environment.key_of_kernels()
    if setup_environment.read(stamp) == key:
        return
    shutil.rmtree(KERNELS, ignore_errors=True)
    package = KERNELS / setup_environment.KERNELS_PACKAGE
    setup_environment.build_kernels(package, str(COMMANDS / "g++"))
    for path in (ROOT / "src" / package.name / package.name).glob("*.py"):
        (package / path.name).symlink_to(path)
    stamp.write_text(key)


def step(name: str, what: str, command: Sequence[str]) -> None:
    """Run a program of the set-up; its end goes into the sentence where it fails."""
    environment = {**setup_environment.outside("wheels"), "LC_ALL": "C"}
    setup_environment.run(f"{LOGS_NAMED}-{name}", what, command, environment)


def environment() -> dict[str, str]:
    """That of an ARM64 program: the sources of the packages, and compiled modules of its own."""
    packages = sorted(path.parent for path in ROOT.glob("src/*/setup.cfg"))
    folders = [KERNELS, ROOT / "sitl", *packages]
    kept = {name: os.environ[name] for name in ("HOME", "PATH") if name in os.environ}
    return {
        **kept,
        "PYTHONPATH": ":".join(map(str, folders)),
        "PYTHONPYCACHEPREFIX": str(FOLDER / "compiled"),
    }


def run_tests(paths: Sequence[str]) -> bool:
    """Run tests on ARM64; of whole files not the slow and broad ones. Return if all passed."""
    command = [str(VENV / "bin/python"), "-m", "pytest", "-q", "-n", "2", "--dist", "loadgroup"]
    command += ["--max-worker-restart", "0", "-p", "no:cacheprovider"]
    if not any("::" in path for path in paths):
        command += ["-m", "not wide"]
    return timed(", ".join(paths[:1]), [*command, *paths], environment())


def set_up_names_the_remedy() -> bool:
    """Run the set-up on ARM64 without a sourced ROS; return whether it says what to do."""
    clone = FOLDER / "clone"
    shutil.rmtree(clone, ignore_errors=True)
    for name in ("scripts", "requirements"):
        shutil.copytree(ROOT / name, clone / name)
    shutil.copy(ROOT / "VERSION", clone)
    command = [str(DEBIAN / "usr/bin/python"), "-I", "-S"]
    command += [str(clone / "scripts/setup_environment.py"), "--ros", "wheels"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    print(done.stderr.strip(), flush=True)
    return done.returncode == 1 and "for x86-64 only, and this is aarch64" in done.stderr


def wheels_work() -> bool:
    """Test the wheels of simulator and logs, installed on ARM64; return whether all passed."""
    named = {**os.environ, "WHEEL_PYTHONS": str(VENV / "bin/python")}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "arm64"]
    return timed("wheels", [*command, "tests/unit/test_wheels.py"], named)


def timed(what: str, command: Sequence[str], variables: Mapping[str, str]) -> bool:
    """Run a part and print how long it took; return whether it succeeded."""
    begun_s = time.monotonic()
    code = subprocess.call(command, cwd=ROOT, env=variables)
    print(f"ARM64, {what}: {time.monotonic() - begun_s:.0f} s", flush=True)
    return code == 0


if __name__ == "__main__":
    sys.exit(main())
