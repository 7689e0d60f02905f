"""Makes the environment of the project: pinned packages in .venv, the workspace in install.

Run by setup.sh, with the interpreter that the environment is to be made from; needs nothing
but the standard library. Each step leaves a stamp as the last thing it does. A stamp names all
that the step depended on, so a step runs again when one of those changes, and after it was
interrupted. A step that fails leaves what it had made before.

.venv has what running needs. Packages for development, and those that single commands need, come
on top of that when they are asked for. The interfaces come from a wheel that fits, if there is
one; else they are built with tools in build/, which goes again.
"""

from __future__ import annotations

import argparse
import atexit
import base64
import contextlib
import ctypes
import fcntl
import functools
import hashlib
import itertools
import os
import platform
import re
import resource
import shlex
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import time
import zipfile
from configparser import ConfigParser
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    Environment = Mapping[str, str]

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
INSTALL = ROOT / "install"
LOGS = ROOT / "log" / "setup"
BUILD = ROOT / "build"
# Compiled without ROS or the headers of Python, so one library works for all of them. Sums are
# rounded alike on every machine.
KERNELS_PACKAGE = "navigation_kernels"
KERNELS_LIBRARY = f"lib{KERNELS_PACKAGE}.so"
KERNELS_SOURCES = ROOT / "src" / KERNELS_PACKAGE / "kernels"
KERNELS_FLAGS = ("-std=c++17", "-O3", "-ffp-contract=off", "-fPIC", "-shared")
# How interfaces are built.
INTERFACES_BUILD = ROOT / "scripts" / "interfaces"
PACKAGES = INSTALL / "packages"
INTERFACES = INSTALL / "interfaces"
KERNELS = INSTALL / "kernels"
PACKAGES_STAMP = VENV / "packages.stamp"
INTERFACES_STAMP = INTERFACES / "interfaces.stamp"
KERNELS_STAMP = KERNELS / "kernels.stamp"
WORKSPACE_STAMP = INSTALL / "workspace.stamp"
# Interval of progress messages without a terminal, in seconds.
TELL_S = 15.0
# Interfaces that the wheels of ROS lack: built from definitions of our own where they are missing.
STAND_INS = ("geographic_msgs", "tf2_msgs")
# The same, but only when they are asked for: these take as long as all others.
ON_DEMAND = ("nav2_msgs",)
# Commands of ours for a ROS that lacks them.
STAND_IN_COMMANDS = ("ros2",)
# Packages that are compiled where none of their wheels fits: empy has none, ruckig none for ARM64.
# All others are wheels.
COMPILED = ("empy", "ruckig")
# ROS 2 as wheels, by the name of its locks: the distribution.
WHEELS = {"wheels": "Jazzy", "kilted": "Kilted"}
# Pythons that the locks are for, but that no machine of the tests has.
UNTRIED = (3, 14)
# Packages on top of those for running, each with a lock of its own. "dev" contains "extras".
LAYERS = ("extras", "dev")
# Free disk that the set-up needs: .venv, the tools of the build, and packages as downloaded; of
# these, the cache of uv has the last, and the folder of temporary files has uv itself.
NEEDED_DISK_MB, NEEDED_CACHE_MB, NEEDED_TEMPORARY_MB = 1000, 500, 100
WHEEL_NAME = "mavbridge_interfaces"
WHEELS_FOLDER = "MAVBRIDGE_WHEELS"
# Progress lines of CMake and Ninja.
PROGRESS = re.compile(r"^(?:-- (Configuring done|Installing)|(\[ *\d+/\d+\]))", re.MULTILINE)
OURS = (VENV, INSTALL, BUILD)
# Ends the name of a folder while another one is made in its place.
BEFORE = ".before"
ENVIRONMENT_FILE = INSTALL / "environment.bash"
# Modules that `make demo` and the server import.
IMPORTED = (
    "drone_navigation.demo",
    "drone_navigation.navigation_client",
    "drone_navigation.navigation_server",
    "flight_reports.flight_plot",
    "mavlink_sitl.__main__",
)
# Appended to rosidl_parser/parser.py: a definition is parsed by seven generators.
PARSED_ONCE = """

_parse_idl_file = parse_idl_file


def parse_idl_file(locator, png_file=None):
    import pickle

    path = f"{locator.get_absolute_path()}.parsed"
    try:
        with open(path, "rb") as file:
            return pickle.load(file)
    except FileNotFoundError:
        parsed = _parse_idl_file(locator, png_file)
    part = f"{path}.{os.getpid()}"
    with open(part, "wb") as file:
        pickle.dump(parsed, file)
    os.replace(part, path)
    return parsed
"""

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
    parser.add_argument("--ros", choices=(*WHEELS, "system"), required=True)
    parser.add_argument(
        "--with",
        dest="wanted",
        action="append",
        choices=(*ON_DEMAND, *LAYERS),
        default=[],
        help="also build these interfaces, unless the sourced ROS has them; or also install what "
        "single commands (extras) or development (dev) need",
    )
    parser.add_argument(
        "--nav2-form",
        default="",
        metavar="1.5",
        help="form of nav2_msgs to build, instead of that of ROS: 1.3, 1.4 or 1.5 (for tests)",
    )
    parser.add_argument(
        "--wheel", type=Path, metavar="DIR", help="only build the wheel of the interfaces into DIR"
    )
    options = parser.parse_args()
    # A signal to this process also ends its children.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    started = time.monotonic()
    try:
        with only_one_at_a_time():
            if options.wheel:
                print(make_wheel(options.wheel.resolve()))
                return 0
            for before in (*ROOT.glob(f"*{BEFORE}"), *INSTALL.glob(f"*{BEFORE}")):
                put_back(before)
            changed = update(options.ros)
            for name in options.wanted:
                if name in LAYERS:
                    changed = add_layer(options.ros, name) or changed
                else:
                    changed = add_interfaces(options.ros, name, options.nav2_form) or changed
    except SetupError as error:
        print(f"Set-up failed: {error}", file=sys.stderr)
        return 1
    except OSError as error:
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
        ros: one of WHEELS, or "system".

    Returns:
        Whether there was anything to do.
    """
    packages_key = key_of_packages(ros)
    packages_due = read(PACKAGES_STAMP) != packages_key
    names = ("custom_interfaces", *STAND_INS)
    interfaces_key = f"{packages_key}\n{hash_of_interfaces(ros, names)}"
    interfaces_due = packages_due or read(INTERFACES_STAMP) != interfaces_key
    kernels_key = key_of_kernels()
    kernels_due = read(KERNELS_STAMP) != kernels_key
    workspace_key = f"{interfaces_key}\n{kernels_key}\n{hash_of(workspace_inputs())}"
    compiles = interfaces_due or kernels_due
    if not compiles and read(WORKSPACE_STAMP) == workspace_key:
        return False
    wheel = fitting_wheel() if ros == "wheels" and compiles else None
    unfit = misfits(ros) if ros in WHEELS and compiles and wheel is None else ""
    check_prerequisites(ros, packages_due, compiles=compiles and wheel is None)
    where = f"ROS 2 {WHEELS[ros]} from pinned wheels" if ros in WHEELS else sourced_ros()
    print(f"Setting up with Python {platform.python_version()} and {where}.", flush=True)
    if unfit:
        print(f"  The interfaces are built, for no wheel of them fits: {unfit}.", flush=True)
    if sys.version_info >= UNTRIED:
        print("  No test has run on this version of Python; all packages exist for it.", flush=True)
    WORKSPACE_STAMP.unlink(missing_ok=True)
    if packages_due:
        with replacing(VENV):
            install_packages(ros)
            PACKAGES_STAMP.write_text(packages_key)
    if interfaces_due:
        with replacing(INTERFACES):
            if wheel is None:
                build_interfaces(ros, names, INTERFACES)
            else:
                unpack(wheel, INTERFACES)
            INTERFACES_STAMP.write_text(interfaces_key)
    if kernels_due:
        with replacing(KERNELS):
            if wheel is None:
                build_kernels(KERNELS)
            else:
                take_kernels(wheel, KERNELS)
            KERNELS_STAMP.write_text(kernels_key)
    with replacing(PACKAGES):
        link_packages(ros)
    record_environment(ros)
    prepare_start(ros)
    WORKSPACE_STAMP.write_text(workspace_key)
    return True


@contextlib.contextmanager
def replacing(folder: Path, *, keeps_content: bool = False) -> Iterator[None]:
    """Lets a folder be made again, or changed; what was there before comes back when that fails.

    After a set-up that was killed, the next one puts it back (`put_back`). To change a folder, its
    files are linked, not copied: nothing writes into a file that is there.
    """
    before = folder.with_name(f"{folder.name}{BEFORE}")
    put_back(before)
    shutil.rmtree(BUILD, ignore_errors=True)
    try:
        if folder.exists() and keeps_content:
            # `before` is whole as soon as it has its name.
            shutil.copytree(folder, BUILD, symlinks=True, copy_function=os.link)
            BUILD.rename(before)
        elif folder.exists():
            folder.rename(before)
        try:
            yield
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            put_back(before)
            raise
        if before.exists():
            # No longer to be put back, even if this is killed while it removes the files.
            before.rename(BUILD)
    finally:
        shutil.rmtree(BUILD, ignore_errors=True)


def put_back(before: Path) -> None:
    """Puts a folder back that a set-up was replacing when it failed or was killed."""
    folder = before.with_name(before.name.removesuffix(BEFORE))
    if before.exists():
        # Away at once: a program that a killed set-up left may still write into it.
        shutil.rmtree(BUILD, ignore_errors=True)
        if folder.exists():
            folder.rename(BUILD)
        before.rename(folder)
        shutil.rmtree(BUILD, ignore_errors=True)


def lock_of(ros: str, layer: str = "") -> Path:
    """The file that pins what running needs, or one that also pins a layer on top of that."""
    return ROOT / "requirements" / (f"{ros}-{layer}.txt" if layer else f"{ros}.txt")


def base_interpreter() -> str:
    """The interpreter that .venv is made from, also when .venv's own one runs this."""
    path: str = sys._base_executable  # type: ignore[attr-defined]
    return os.path.realpath(path)


def key_of_packages(ros: str) -> str:
    """Return what the installed packages depend on: interpreter, place, ROS, lock, this file."""
    underlay = outside(ros).get("AMENT_PREFIX_PATH", "")
    content = hash_of([lock_of(ros), Path(__file__).resolve()])
    return "\n".join([base_interpreter(), sys.version, str(ROOT), ros, underlay, content])


def workspace_inputs() -> Iterator[Path]:
    """The files that are copied or linked. Python modules are linked as whole packages."""
    for package in python_packages():
        for name in ("package.xml", "pyproject.toml", "setup.cfg", "launch", "resource"):
            path = package / name
            yield from sorted(path.glob("*")) if path.is_dir() else [path]


def python_packages() -> list[Path]:
    """The folders of the Python packages."""
    files = sorted([*ROOT.glob("src/*/setup.cfg"), ROOT / "sitl/setup.cfg"])
    return [path.parent for path in files]


def sourced_ros() -> str:
    """The ROS that is sourced, as people call it."""
    return f"the sourced ROS 2 {os.environ.get('ROS_DISTRO', '').capitalize()}"


def hash_of_interfaces(ros: str, names: Iterable[str]) -> str:
    """A digest of all that compiled interfaces depend on, but for the interpreter."""
    folders = [*(ROOT / "src" / name for name in names), INTERFACES_BUILD]
    files = (path for folder in folders for path in sorted(folder.rglob("*")))
    return hash_of([*files, lock_of(ros, "build")])


def key_of_kernels() -> str:
    """Return what the compiled part of planning depends on: machine, flags, sources."""
    sources = hash_of(sorted(KERNELS_SOURCES.glob("*.?pp")))
    return "\n".join([platform.machine(), " ".join(KERNELS_FLAGS), sources])


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


def check_prerequisites(ros: str, packages: bool = True, compiles: bool = True) -> None:
    """Looks for what a package manager has to provide.

    Args:
        ros: one of WHEELS, or "system".
        packages: whether packages are to be installed into .venv.
        compiles: whether interfaces are to be compiled.

    Raises:
        SetupError: something is missing; names all of it, with the Debian or Ubuntu packages.
    """
    if ros in WHEELS and platform.machine() != "x86_64":
        name = WHEELS[ros].lower()
        raise SetupError(
            f"ROS 2 exists as wheels for x86-64 only, and this is {platform.machine()}: install "
            f"ROS 2 {WHEELS[ros]} (on Ubuntu 24.04: sudo apt install ros-{name}-ros-base), run "
            f"'. /opt/ros/{name}/setup.bash' and then this again, without MAVBRIDGE_ROS={ros}."
        )
    missing, names = [], []
    compilers = (("CC", "cc", "the C compiler"), ("CXX", "c++", "the C++ compiler"))
    for variable, default, what in compilers if compiles else ():
        # Like CMake, take CC with arguments ("ccache gcc").
        command = (shlex.split(os.environ.get(variable, "")) or [default])[0]
        if shutil.which(command) is None:
            missing.append(f"there is no {command} ({what})")
            names.append("build-essential")
    python = base_interpreter()
    # Debian's packages are named after the version when it is not the default one.
    package = Path(python).name if python.startswith("/usr/bin/") else "python3"
    if compiles and not Path(sysconfig.get_path("include"), "Python.h").is_file():
        missing.append(f"the headers of {python} are missing")
        names.append(f"{package}-dev")
    probe = [python, "-I", "-c", "import ensurepip, venv"]
    if subprocess.run(probe, stderr=subprocess.DEVNULL, check=False).returncode:
        missing.append(f"the venv module of {python} is missing")
        names.append(f"{package}-venv")
    text = ", ".join(missing)
    if text:
        text = f"{text[0].upper()}{text[1:]}: sudo apt install {' '.join(dict.fromkeys(names))}"
        if compiles and ros == "wheels" and (reasons := misfits(ros)):
            text += f", or use a wheel of the interfaces that fits: {reasons}"
    for shortage in short_disks() if packages else ():
        text += f"; also, {shortage}" if text else shortage
    if text:
        raise SetupError(text)


def short_disks() -> Iterator[str]:
    """The disks that have not enough left for packages, each said with the folder on it."""
    caches = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    cache = os.environ.get("UV_CACHE_DIR") or Path(caches, "uv")
    seen = set()
    for folder, needed_mb in (
        (ROOT, NEEDED_DISK_MB),
        (Path(cache).absolute(), NEEDED_CACHE_MB),
        (Path(tempfile.gettempdir()), NEEDED_TEMPORARY_MB),
    ):
        there = next(path for path in (folder, *folder.parents) if path.exists())
        free_mb = shutil.disk_usage(there).free // 1_000_000
        disk = there.stat().st_dev
        if disk not in seen and free_mb < needed_mb:
            yield f"{folder} has {free_mb} MB of free disk, and the set-up needs {needed_mb} MB"
        seen.add(disk)


def install_packages(ros: str) -> None:
    """Makes a new .venv, with exactly the packages that running needs."""
    command: list[str | Path] = [base_interpreter(), "-m", "venv", "--without-pip", VENV]
    run("venv", "Making .venv", command, outside("wheels"))
    install_lock(lock_of(ros), VENV)
    # Headers are for the build, which has its own; they are 30 MB.
    shutil.rmtree(VENV / "include", ignore_errors=True)


def add_layer(ros: str, layer: str) -> bool:
    """Installs packages on top of those that running needs.

    Args:
        ros: one of WHEELS, or "system".
        layer: one of LAYERS.

    Returns:
        Whether there was anything to do.
    """
    lock = lock_of(ros, layer)
    stamp = VENV / f"{layer}.stamp"
    key = f"{read(PACKAGES_STAMP)}\n{hash_of([lock])}"
    if read(stamp) == key:
        return False
    check_prerequisites(ros, compiles=False)
    with replacing(VENV, keeps_content=True):
        install_lock(lock, VENV)
        stamp.unlink(missing_ok=True)
        stamp.write_text(key)
    return True


def install_lock(lock: Path, where: Path) -> None:
    """Installs the packages of a lock that a virtual environment does not have yet.

    It is uv that installs them, in a tenth of pip's time.
    """
    uv, variables = installer()
    install: list[str | Path] = [uv, "--no-config", "--system-certs", "pip", "install"]
    install += [*options_of_lock(lock), "--python", where / "bin" / "python"]
    text = lock.read_text()
    if "\nempy==" in text:
        # It is built with the pinned setuptools, installed first.
        tools = where / "build-tools.txt"
        tools.write_text(blocks_of(lock, "setuptools"))
        run("build-tools", "Installing setuptools", [*install, "-r", tools], variables)
        install += ["--no-build-isolation"]
    count = len(re.findall(r"^\S+==", text, re.MULTILINE))
    what = f"Installing {count} pinned packages"
    if platform.machine() != "x86_64" and "\nruckig==" in text:
        what += ", ruckig from source"
    run(f"packages-{lock.stem}", what, [*install, "-r", lock], variables)


def options_of_lock(lock: Path) -> list[str]:
    """The options of `uv pip install` for a lock, which is complete: there is nothing to resolve.

    Wheels only, except for what has to be compiled. What ruckig is built with is pinned, too,
    rather than whatever is newest on the day.
    """
    options = ["--index-strategy", "unsafe-best-match", "--no-deps", "--require-hashes"]
    options += ["--build-constraints", str(lock_of("system", "build"))]
    names = set(re.findall(r"^(\S+)==", lock.read_text(), re.MULTILINE))
    return options + [f"--only-binary={name}" for name in sorted(names - set(COMPILED))]


@functools.cache
def installer() -> tuple[Path, dict[str, str]]:
    """uv, as pinned, and the environment to run it in.

    It belongs to the packages for development. Where they are not installed it comes from a folder
    that goes with this process, put there by the pip that every Python has for its environments.
    """
    # uv looks for packages where pip is to look; where they go is not the user's choice.
    ignored = ("PIP_USER", "PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "UV_TARGET", "UV_PREFIX")
    environment = {k: v for k, v in outside("wheels").items() if k not in ignored}
    pip = {**environment, "PYTHONPATH": str(bundled_pip()), "PIP_REQUIRE_VIRTUALENV": "0"}
    python: list[str | Path] = [base_interpreter(), "-S", "-m", "pip"]
    uv = VENV / "bin" / "uv"
    if not uv.exists():
        folder = tempfile.mkdtemp(prefix="mavbridge-")
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        uv, pin = Path(folder, "bin", "uv"), Path(folder, "uv.txt")
        pin.write_text(blocks_of(lock_of("wheels", "dev"), "uv"))
        options = "--no-input --no-deps --require-hashes --disable-pip-version-check"
        command = [*python, "install", *options.split(), "--only-binary", ":all:"]
        run("installer", "Fetching uv", [*command, "--target", folder, "-r", pin], pip)
    listed = subprocess.run([*python, "config", "list"], env=pip, stdout=-1, check=False).stdout
    return uv, {**settings_of_pip(os.fsdecode(listed)), **environment}


def bundled_pip() -> Path:
    """The wheel of pip that belongs to this Python's ensurepip."""
    folders = [sysconfig.get_config_var("WHEEL_PKG_DIR") or ""]
    folders += [str(Path(sysconfig.get_path("stdlib"), "ensurepip", "_bundled"))]
    return next(path for each in folders if each for path in Path(each).glob("pip-*.whl"))


def settings_of_pip(listed: str) -> dict[str, str]:
    """Return variables by which uv gets packages from where pip's settings say.

    Args:
        listed: what `pip config list` writes; what comes later there counts more.
    """
    names = {
        "index-url": "UV_DEFAULT_INDEX",
        "extra-index-url": "UV_INDEX",
        "find-links": "UV_FIND_LINKS",
        "no-index": "UV_NO_INDEX",
        "cert": "SSL_CERT_FILE",
    }
    found = {}
    setting = re.compile(r"^(?:global|install|:env:)\.([\w-]+)='(.*)'$", re.MULTILINE)
    for key, value in setting.findall(listed):
        if key in names:
            found[names[key]] = " ".join(value.replace("\\n", " ").split())
    if "UV_FIND_LINKS" in found:
        found["UV_FIND_LINKS"] = found["UV_FIND_LINKS"].replace(" ", ",")
    return found


def blocks_of(lock: Path, *names: str) -> str:
    """The entries of some packages in a lock, with their hashes."""
    blocks = re.split(r"\n(?=\S)", lock.read_text())
    return "\n".join(b for b in blocks if b.split("==", 1)[0] in names) + "\n"


def build_interfaces(ros: str, names: Sequence[str], *prefixes: Path, form: str = "") -> None:
    """Compiles packages of interfaces, but for those that ROS has.

    Args:
        ros: one of WHEELS, or "system".
        names: of the packages, in src.
        prefixes: the folder to install into, and others with interfaces that these need.
        form: of nav2_msgs; empty for that of ROS.
    """
    prefix = prefixes[0]
    with build_tools(ros) as (python, environment):
        needed = [name for name in names if not is_provided(name, environment)]
        for variable in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH"):
            environment[variable] = ":".join([*map(str, prefixes), environment[variable]])
        # Those on demand need the others, installed.
        first = [name for name in needed if name not in ON_DEMAND]
        for group in (first, [name for name in needed if name in ON_DEMAND]):
            if not group:
                continue
            title = "-".join(group)
            script = 'cmake -G Ninja "$@" && cmake --build "$2" --target install'
            command: list[str | Path] = ["bash", "-c", script, "bash"]
            command += ["-B", BUILD / title, "-S", INTERFACES_BUILD, "-DBUILD_TESTING=OFF"]
            command += [f"-DCMAKE_INSTALL_PREFIX={prefix}", f"-DPython3_EXECUTABLE={python}"]
            command += [f"-DPACKAGES={';'.join(str(ROOT / 'src' / name) for name in group)}"]
            command += [f"-DCMAKE_PROJECT_INCLUDE={INTERFACES_BUILD / 'one_unit.cmake'}"]
            command += [f"-DNAV2_MSGS_FORM={form}"]
            run(title, f"Building {', '.join(group)}", command, environment)


def build_kernels(folder: Path, compiler: str = "") -> None:
    """Compiles the library of navigation_kernels into a folder; CXX names another compiler."""
    folder.mkdir(parents=True, exist_ok=True)
    chosen = shlex.split(compiler or os.environ.get("CXX", "")) or ["c++"]
    command: list[str | Path] = [*chosen, *KERNELS_FLAGS]
    command += [*sorted(KERNELS_SOURCES.glob("*.cpp")), "-o", folder / KERNELS_LIBRARY]
    run("kernels", f"Building {KERNELS_PACKAGE}", command, outside("wheels"))


def take_kernels(wheel: Path, folder: Path) -> None:
    """Takes that library from a wheel."""
    folder.mkdir(parents=True, exist_ok=True)
    with opened(wheel) as archive:
        library = archive.read(f"{KERNELS_PACKAGE}/{KERNELS_LIBRARY}")
    (folder / KERNELS_LIBRARY).write_bytes(library)


@contextlib.contextmanager
def build_tools(ros: str) -> Iterator[tuple[Path, dict[str, str]]]:
    """An interpreter with CMake and the generators of ROS, and the environment to run them in.

    They are in build/, which goes when this ends: 200 MB that only the compilation needs.
    """
    tools = BUILD / "tools"
    shutil.rmtree(BUILD, ignore_errors=True)
    try:
        command: list[str | Path] = [base_interpreter(), "-m", "venv", "--without-pip", tools]
        run("venv", "Making an environment for the build", command, outside("wheels"))
        install_lock(lock_of(ros, "build"), tools)
        if ros in WHEELS:
            mend_cmake_files(tools)
            leave_out_generator(tools, "rosidl_typesupport_introspection_cpp")
            keep_parsed_definitions(tools)
        environment = base_environment(ros, tools)
        # Some dozen processes import the same modules.
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        yield tools / "bin" / "python", environment
    finally:
        shutil.rmtree(BUILD, ignore_errors=True)


def mend_cmake_files(tools: Path) -> None:
    """Points the CMake files of the ROS wheels at an environment.

    They name the include folders of the machine that the wheels were built on, and CMake
    stops at folders that don't exist.
    """
    include = re.compile(r"/opt/python/[^/;\"]+/include/python3\.\d+")
    packages = re.compile(r"/opt/python/[^/;\"]+/lib/python3\.\d+/site-packages")
    for path in (tools / "share").glob("*/cmake/*.cmake"):
        text = path.read_text()
        mended = include.sub(sysconfig.get_path("include"), text)
        mended = packages.sub(str(site_packages(tools)), mended)
        if mended != text:
            rewrite(path, mended)


def leave_out_generator(tools: Path, name: str) -> None:
    """Keeps a generator from making code that no Python program loads."""
    path = tools / "share" / name / "cmake" / f"{name}-extras.cmake"
    kept = re.sub(r"ament_register_extension\([^)]*\)", "", path.read_text())
    rewrite(path, kept)


def keep_parsed_definitions(tools: Path) -> None:
    """Lets the generators read each definition once: parsing is a third of their time."""
    path = site_packages(tools) / "rosidl_parser" / "parser.py"
    rewrite(path, path.read_text() + PARSED_ONCE)


def rewrite(path: Path, text: str) -> None:
    """Changes a file at once, and not uv's cache that it may be a hard link into."""
    part = path.with_name(f"{path.name}.part")
    part.write_text(text)
    part.replace(path)


def make_wheel(folder: Path) -> Path:
    """Builds all that is compiled, packed as a wheel for this version of Python.

    It works beside the pinned wheels of ROS, and wherever these do. The set-up takes it instead of
    building (`fitting_wheel`).

    Args:
        folder: where to put it.

    Returns:
        The wheel.
    """
    check_prerequisites("wheels")
    with tempfile.TemporaryDirectory(prefix="mavbridge-") as scratch:
        prefix = Path(scratch, "prefix")
        build_interfaces("wheels", (*STAND_INS, "custom_interfaces", *ON_DEMAND), prefix)
        kernels = site_packages(prefix) / KERNELS_PACKAGE
        build_kernels(kernels)
        for path in sorted((KERNELS_SOURCES.parent / KERNELS_PACKAGE).glob("*.py*")):
            if path.is_file():
                shutil.copy(path, kernels)
        files = sorted(path for path in prefix.rglob("*") if path.is_file())
        libraries = [path.read_bytes() for path in files if path.suffix == ".so"]
        # The C library that they need decides where they work; installers know 2.17 and later.
        found = [int(n) for b in libraries for n in re.findall(rb"GLIBC_2\.(\d+)", b)]
        tag = f"{python_tag()}-{python_tag()}-manylinux_2_{max(17, *found)}_x86_64"
        about = f"{WHEEL_NAME}-{wheel_version()}"
        folder.mkdir(parents=True, exist_ok=True)
        wheel = folder / f"{about}-{tag}.whl"
        record = []
        with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:

            def add(name: str, content: bytes) -> None:
                digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=")
                record.append(f"{name},sha256={digest.decode()},{len(content)}")
                archive.writestr(name, content)

            for path in files:
                inside = path.relative_to(prefix)
                # Headers are for packages that are compiled on top of these.
                if inside.parts[0] != "include" and "__pycache__" not in inside.parts:
                    modules = site_packages(prefix)
                    if modules in path.parents:
                        add(str(path.relative_to(modules)), path.read_bytes())
                    else:
                        add(f"{about}.data/data/{inside}", path.read_bytes())
            summary = "mavbridge: its interfaces for ROS 2 Jazzy from wheels"
            metadata = f"Metadata-Version: 2.1\nName: {WHEEL_NAME.replace('_', '-')}\n"
            metadata += f"Version: {wheel_version()}\nSummary: {summary}\nLicense: Apache-2.0\n"
            metadata += "Requires-Dist: ros-jazzy-common-interfaces\n"
            metadata += "Requires-Dist: ros-jazzy-rclpy[fastrtps]\n"
            kind = f"Wheel-Version: 1.0\nGenerator: mavbridge\nRoot-Is-Purelib: false\nTag: {tag}\n"
            add(f"{about}.dist-info/METADATA", metadata.encode())
            add(f"{about}.dist-info/WHEEL", kind.encode())
            add(f"{about}.dist-info/licenses/LICENSE", (ROOT / "LICENSE").read_bytes())
            listed = "\n".join([*record, f"{about}.dist-info/RECORD,,", ""])
            archive.writestr(f"{about}.dist-info/RECORD", listed)
    return wheel


def python_tag() -> str:
    """The tag of this version of Python in the name of a wheel."""
    return f"cp{sys.version_info.major}{sys.version_info.minor}"


def wheel_version() -> str:
    """The version of a wheel of interfaces, with a digest of what it was built from."""
    interfaces = hash_of_interfaces("wheels", ("custom_interfaces", *STAND_INS, *ON_DEMAND))
    digest = hashlib.sha256(f"{interfaces}\n{key_of_kernels()}".encode()).hexdigest()
    return f"{(ROOT / 'VERSION').read_text().strip()}+{digest[:12]}"


def fitting_wheel() -> Path | None:
    """A wheel of exactly these interfaces for this Python and this C library; None without one.

    It may be in wheels/, or in the folder that MAVBRIDGE_WHEELS names.
    """
    start = f"{WHEEL_NAME}-{wheel_version()}-{python_tag()}-{python_tag()}"
    name = re.compile(rf"{re.escape(start)}-manylinux_2_(\d+)_x86_64\.whl")
    kind, _, version = (os.confstr("CS_GNU_LIBC_VERSION") or "").partition(" 2.")
    for path in given_wheels():
        found = name.fullmatch(path.name)
        if found and kind == "glibc" and int(found[1]) <= int(version):
            return path
    return None


def misfits(ros: str) -> str:
    """Why none of the wheels that are there fits, in sentences without the last one's end."""
    return "; ".join(misfit(wheel, ros) for wheel in given_wheels())


def misfit(wheel: Path, ros: str) -> str:
    """Why a wheel is none of these interfaces for this machine, as a sentence without its end.

    Args:
        wheel: one that does not fit.
        ros: one of WHEELS.
    """
    about = re.fullmatch(r"[^-]+-([^-]+)-([^-]+)-[^-]+-(\w+?_\d+_\d+)_(\w+)\.whl", wheel.name)
    if about is None:
        return f"{wheel.name} is not named as such a wheel is"
    if ros != "wheels":
        return f"{wheel.name} is for ROS 2 {WHEELS['wheels']}, and this is {WHEELS[ros]}"
    version, tag, library, machine = about.groups()
    if machine != "x86_64" or platform.machine() != "x86_64":
        return f"{wheel.name} is for {machine}, and this is {platform.machine()}"
    if tag != python_tag():
        return f"{wheel.name} is for another Python, and this is {python_tag()}"
    if version != wheel_version():
        return f"{wheel.name} was made of other interfaces than {wheel_version()}"
    have = os.confstr("CS_GNU_LIBC_VERSION") or "no glibc"
    return f"{wheel.name} needs {library}, and this has {have}"


def given_wheels() -> list[Path]:
    """The wheels of interfaces that are there, whether they fit or not."""
    folders = [Path(os.environ[WHEELS_FOLDER])] if os.environ.get(WHEELS_FOLDER) else []
    found = (folder.glob(f"{WHEEL_NAME}-*.whl") for folder in [*folders, ROOT / "wheels"])
    return [path for paths in found for path in sorted(paths)]


def unpack(wheel: Path, prefix: Path) -> None:
    """Puts the interfaces of a wheel where a build puts them."""
    print(f"  Taking the interfaces from {wheel.name}", flush=True)
    with opened(wheel) as archive:
        for name in archive.namelist():
            if name.startswith(f"{KERNELS_PACKAGE}/"):
                continue
            _, data, rest = name.partition(".data/data/")
            path = prefix / rest if data else site_packages(prefix) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(archive.read(name))


@contextlib.contextmanager
def opened(wheel: Path) -> Iterator[zipfile.ZipFile]:
    """A wheel to read from, or a sentence that it is damaged."""
    try:
        with zipfile.ZipFile(wheel) as archive:
            yield archive
    except (zipfile.BadZipFile, KeyError) as error:
        raise SetupError(f"{wheel} is damaged: {error}") from error


def site_packages(prefix: Path) -> Path:
    """Where the Python packages of a prefix are."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    return prefix / "lib" / version / "site-packages"


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
    if ros in WHEELS:
        result = {k: v for k, v in result.items() if k not in FOREIGN}
    return result


def base_environment(ros: str, venv: Path = VENV) -> dict[str, str]:
    """The base of the workspace: ROS and a virtual environment, entered."""
    environment = outside(ros)
    if ros in WHEELS:
        environment["AMENT_PREFIX_PATH"] = str(venv)
        # The start-up hook of the wheels would set these by starting the interpreter twice.
        libraries = [venv / "lib", *sorted(site_packages(venv).glob("ros_*.libs"))]
        environment["LD_LIBRARY_PATH"] = ":".join(map(str, libraries))
        environment["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    environment.setdefault("CMAKE_PREFIX_PATH", environment["AMENT_PREFIX_PATH"])
    environment["VIRTUAL_ENV"] = str(venv)
    environment["PATH"] = f"{venv / 'bin'}:{environment['PATH']}"
    return environment


def is_provided(name: str, environment: Environment) -> bool:
    """Whether the ROS below the workspace has a package."""
    prefixes = environment["AMENT_PREFIX_PATH"].split(":")
    return any(Path(prefix, "share", name).is_dir() for prefix in prefixes)


def lacks_discovery_range(environment: Environment) -> bool:
    """Whether rcl knows no ROS_AUTOMATIC_DISCOVERY_RANGE, as Humble's: its headers say so."""
    prefixes = environment["AMENT_PREFIX_PATH"].split(":")
    folders = [Path(prefix, "include/rcl/rcl") for prefix in prefixes]
    found = [folder for folder in folders if (folder / "init_options.h").is_file()]
    return bool(found) and not any((folder / "discovery_options.h").is_file() for folder in found)


def settings_of(package: Path) -> ConfigParser:
    """Return the settings in a package's setup.cfg; those of its pyproject.toml count, too.

    Python 3.10 has no parser of TOML. Tables of strings and of lists of strings are read here,
    and nothing else is looked at.
    """
    settings = ConfigParser(interpolation=None, delimiters="=")
    settings.optionxform = str  # type: ignore[assignment,method-assign]
    settings.read(package / "setup.cfg", "utf-8")
    if not (package / "pyproject.toml").is_file():
        return settings
    toml = ConfigParser(interpolation=None, delimiters="=", strict=False, allow_no_value=True)
    toml.optionxform = str  # type: ignore[assignment,method-assign]
    toml.read(package / "pyproject.toml", "utf-8")

    def lines(section: str, key: str) -> str:
        return "\n".join(re.findall(r'"([^"]*)"', toml[section][key]))

    def commands(section: str) -> str:
        return "".join(f"\n{name} = {lines(section, name)}" for name in toml[section])

    settings["metadata"] = {
        key: lines("project", key) for key in ("name", "version", "description")
    }
    settings["metadata"]["name"] = settings["metadata"]["name"].replace("-", "_")
    settings["options"] = {
        "install_requires": lines("project", "dependencies"),
        "py_modules": lines("tool.setuptools", "py-modules"),
    }
    settings["options.entry_points"] = {
        "console_scripts": commands("project.scripts"),
        "pytest11": commands("project.entry-points.pytest11"),
    }
    return settings


def link_packages(ros: str) -> None:
    """Links the Python packages of the workspace where Python and ROS look for them.

    A change of a module acts at once. Their setup.cfg or pyproject.toml names all that has to be
    linked: modules, files for ROS and commands; the metadata are those that `importlib.metadata`
    reads.
    """
    modules = site_packages(PACKAGES)
    modules.mkdir(parents=True)
    for package in python_packages():
        settings = settings_of(package)
        about, options = settings["metadata"], settings["options"]
        name = about["name"]
        if name == KERNELS_PACKAGE:
            # Its library is beside its modules, and is no file of the sources.
            (modules / name).mkdir()
            for path in [*(package / name).glob("*.py*"), KERNELS / KERNELS_LIBRARY]:
                (modules / name / path.name).symlink_to(path)
        else:
            (modules / name).symlink_to(package / name)
        for module in options.get("py_modules", "").split():
            (modules / f"{module}.py").symlink_to(package / f"{module}.py")
        section = "options.data_files"
        for folder, patterns in settings.items(section) if settings.has_section(section) else ():
            (PACKAGES / folder).mkdir(parents=True, exist_ok=True)
            for path in (path for pattern in patterns.split() for path in package.glob(pattern)):
                (PACKAGES / folder / path.name).symlink_to(path)
        metadata = modules / f"{name}-{about['version']}.dist-info"
        metadata.mkdir()
        text = f"Metadata-Version: 2.1\nName: {name}\nVersion: {about['version']}\n"
        needs = "".join(f"Requires-Dist: {each}\n" for each in options["install_requires"].split())
        (metadata / "METADATA").write_text(f"{text}Summary: {about['description']}\n{needs}")
        section = "options.entry_points"
        groups = dict(settings.items(section)) if settings.has_section(section) else {}
        points = "".join(f"[{group}]{lines}\n" for group, lines in groups.items())
        (metadata / "entry_points.txt").write_text(points)
        for line in filter(None, groups.get("console_scripts", "").splitlines()):
            command, module, function = re.split(r"\s*[=:]\s*", line)
            if command in STAND_IN_COMMANDS and has_command(ros, command):
                continue
            path = PACKAGES / "lib" / name / command
            path.parent.mkdir(exist_ok=True)
            # A process that multiprocessing spawns imports this again.
            call = f"import sys\nfrom {module} import {function}\nif __name__ == '__main__':\n"
            call += f"    sys.exit({function}())\n"
            path.write_text(f"#!{VENV / 'bin/python'}\n{call}")
            path.chmod(0o755)


def has_command(ros: str, command: str) -> bool:
    """Whether the sourced ROS has a command; what is beside ROS from wheels is not used."""
    return ros == "system" and shutil.which(command, path=base_environment(ros)["PATH"]) is not None


def prepare_start(ros: str) -> None:
    """Writes what bash completes, and lets Python compile what a flight imports.

    Else the first start compiles it; with PYTHONDONTWRITEBYTECODE set, every start does.
    """
    script = "source ./setup.bash && python -m drone_navigation.completion install/completion.bash"
    script += f" && python -c 'import {', '.join(IMPORTED)}'"
    environment = base_environment(ros)
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    run("completion", "Preparing the first start", ["bash", "-c", script], environment)


def add_interfaces(ros: str, name: str, form: str = "") -> bool:
    """Builds interfaces that the workspace does without, and that a rebuild of it keeps.

    Args:
        ros: one of WHEELS, or "system".
        name: of the package.
        form: of the definitions; empty for that of ROS.

    Returns:
        Whether there was anything to do.
    """
    stamp = INSTALL / name / "interfaces.stamp"
    key = f"{read(PACKAGES_STAMP)}\n{hash_of_interfaces(ros, (name, *STAND_INS))}\n{form}"
    if is_provided(name, workspace_environment(ros, INTERFACES)) or read(stamp) == key:
        return False
    check_prerequisites(ros, packages=False)
    with replacing(INSTALL / name):
        build_interfaces(ros, (name,), INSTALL / name, INTERFACES, form=form)
        stamp.write_text(key)
    record_environment(ros)
    return True


def workspace_environment(ros: str, *prefixes: Path) -> dict[str, str]:
    """The environment with some of the folders in install entered."""
    environment = base_environment(ros)
    for prefix in prefixes:
        for variable, folder in (
            ("AMENT_PREFIX_PATH", prefix),
            ("CMAKE_PREFIX_PATH", prefix),
            ("LD_LIBRARY_PATH", prefix / "lib"),
            ("PYTHONPATH", site_packages(prefix)),
        ):
            environment[variable] = f"{folder}:{environment.get(variable, '')}".rstrip(":")
    return environment


def record_environment(ros: str) -> None:
    """Writes what `source setup.bash` changes."""
    more = [INSTALL / name for name in ON_DEMAND if (INSTALL / name).is_dir()]
    after = workspace_environment(ros, *more, INTERFACES, PACKAGES)
    # `ros2 run` finds the executables here; this makes them commands.
    for package in ("flight_logs", "drone_navigation"):
        after["PATH"] = f"{PACKAGES / 'lib' / package}:{after['PATH']}"
    lines = [f"# for {ros}", "# Written by scripts/setup_environment.py, read by setup.bash."]
    before = outside(ros)
    if ros == "system":
        # For shells that have not sourced this ROS.
        before = without_folders(before, before["AMENT_PREFIX_PATH"].split(":"))
        lines.append(f"export ROS_DISTRO={after['ROS_DISTRO']} ROS_VERSION=2 ROS_PYTHON_VERSION=3")
        if lacks_discovery_range(after):
            lines.append("export ROS_LOCALHOST_ONLY=1")
    else:
        lines.append(f"unset {' '.join(FOREIGN)}")
        lines.append("export _ROS_WHEELS_BOOTSTRAP_COMPLETE=1")
    for variable in sorted(after.keys() & PATH_LISTS):
        known = {"", *before.get(variable, "").split(":")}
        new = [entry for entry in after[variable].split(":") if entry not in known]
        if new:
            lines.append(f"_mavbridge_prepend {variable} {shlex.quote(':'.join(new))}")
    lines.append(f"export VIRTUAL_ENV={shlex.quote(str(VENV))}")
    rewrite(ENVIRONMENT_FILE, "\n".join(lines) + "\n")


def progress(log: str) -> str:
    """Return where a step is, by its log: the package, and how much of it has been compiled."""
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
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with log.open("w") as output:
        process = subprocess.Popen(
            list(map(str, command)),
            env=environment,
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            preexec_fn=end_with_set_up,  # noqa: PLW1509 - there are no threads
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
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    with (LOGS / "cpu_seconds.log").open("a") as times:
        times.write(f"{cpu_s:7.1f} s  {what}\n")
    if process.returncode:
        raise SetupError(
            f"'{what}' ended with code {process.returncode}"
            f"{reason(log.read_text(errors='replace'))}; the whole output is in {log}"
        )


def end_with_set_up() -> None:
    """Lets this process be killed with its parent; an installation would continue without it."""
    pr_set_pdeathsig = 1
    ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL)


def reason(log: str) -> str:
    """Return the reason for a failure from a program's output, for the end of a sentence."""
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    full = "No space left on device"
    # uv lists the causes of an error below it, pip names what it did without, apt writes "E: ".
    listed = [line.partition(": ")[2] for line in lines if re.match("(?i:error|cause|e): ", line)]
    if listed:
        text = ": ".join(part[:150] for part in dict.fromkeys([*listed[:2], listed[-1]]))
        # pip forgets that there was no connection; uv says at the end of a long line what was full.
        text += "; the package index was not reached" if "connection broken by" in log else ""
        return f": {text}{'' if full not in log or full in text else f': {full}'}"
    for pattern in (full, r"\berror\b|Failed to|FAILED", r""):
        for line, next_line in itertools.zip_longest(lines, lines[1:], fillvalue=""):
            if re.search(pattern, line, re.IGNORECASE):
                # CMake says where in one line, and what in the next.
                return f": {f'{line} {next_line}' if line.endswith(':') else line:.300}"
    return ""


if __name__ == "__main__":
    sys.exit(main())
