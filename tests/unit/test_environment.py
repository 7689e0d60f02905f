"""The set-up says what is missing, and the environment can be entered from anywhere.

The set-up as a whole is what every run of the suite starts with; here are its edges.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

import pytest

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[2]
ROS_KIND = (ROOT / "install/environment.bash").read_text("utf-8").split(None, 3)[2]


def bash(
    script: str, variables: Mapping[str, str] | None = None, cwd: Path = ROOT
) -> subprocess.CompletedProcess[str]:
    """Runs a script in a shell that has nothing but the system's commands."""
    environment = {"PATH": "/usr/bin:/bin", "HOME": os.environ.get("HOME", "/")}
    return subprocess.run(
        ["bash", "-c", script],
        cwd=cwd,
        env={**environment, **(variables or {})},
        capture_output=True,
        text=True,
        timeout=HANGS_AFTER_S,
        check=False,
    )


# --- The set-up ---


@pytest.fixture
def fresh_clone(tmp_path: Path) -> Path:
    """As much of a clone as the checks of the set-up look at, never set up."""
    clone = tmp_path / "clone"
    for folder in ("scripts", "requirements"):
        shutil.copytree(ROOT / folder, clone / folder)
    for name in ("setup.cfg", "package.xml", "pyproject.toml", "resource"):
        for path in [*ROOT.glob(f"src/*/{name}"), *ROOT.glob(f"sitl/{name}")]:
            there = clone / path.relative_to(ROOT)
            there.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree if path.is_dir() else shutil.copy)(path, there)
    shutil.copy(ROOT / "VERSION", clone)
    return clone


def set_up_with(commands: dict[str, str], clone: Path, **variables: str) -> str:
    """Runs the set-up where only some commands exist; returns what it says as it fails.

    Args:
        commands: path by name.
        clone: the folder to set up.
        variables: further environment.
    """
    path = clone / "commands"
    path.mkdir()
    for name, target in commands.items():
        (path / name).symlink_to(target)
    # Should a check not stop it, then this does.
    variables |= {"PATH": str(path), "PIP_NO_INDEX": "1"}
    result = bash("scripts/setup.sh", variables, clone)
    assert result.returncode == 1
    assert not (clone / ".venv").exists()
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    return result.stderr


def commands(*names: str) -> dict[str, str]:
    """The path of each command."""
    found = {name: shutil.which(name) for name in ("bash", "env", "readlink", *names)}
    return {name: path for name, path in found.items() if path}


BASE_PYTHON = os.path.realpath(getattr(sys, "_base_executable", sys.executable))


def test_missing_python_is_one_sentence_with_its_package(fresh_clone: Path) -> None:
    said = set_up_with(commands("cc", "c++"), fresh_clone)
    assert "No Python 3.10 to 3.14 was found: sudo apt install python3" in said


def test_all_that_is_missing_is_one_sentence_with_its_packages(fresh_clone: Path) -> None:
    tools = {**commands(), "python3": BASE_PYTHON}
    said = set_up_with(tools, fresh_clone, MAVBRIDGE_ROS="wheels")
    assert "There is no cc (the C compiler), there is no c++ (the C++ compiler)" in said
    assert said.endswith("sudo apt install build-essential\n")


def test_compiler_named_by_the_environment_is_the_one_looked_for(fresh_clone: Path) -> None:
    tools = {**commands("cc", "c++"), "python3": BASE_PYTHON}
    said = set_up_with(tools, fresh_clone, MAVBRIDGE_ROS="wheels", CXX="no-such-compiler -O2")
    assert "There is no no-such-compiler (the C++ compiler)" in said


@pytest.fixture
def setup_environment() -> ModuleType:
    """The module that does the set-up."""
    return load_set_up()


def load_set_up() -> ModuleType:
    """A new instance of that module, which belongs to no package."""
    path = ROOT / "scripts/setup_environment.py"
    spec = importlib.util.spec_from_file_location("setup_environment", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_arm64_without_a_sourced_ros_is_one_sentence(
    setup_environment: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    monkeypatch.setattr("sys.argv", ["setup_environment.py", "--ros", "wheels"])
    monkeypatch.setattr(setup_environment, "read", lambda _stamp: None)
    monkeypatch.setattr(setup_environment, "put_back", lambda _before: None)
    assert setup_environment.main() == 1
    said = capsys.readouterr().err
    assert said.startswith(
        "Set-up failed: ROS 2 exists as wheels for x86-64 only, and this is aarch64: install ROS 2 "
        "Jazzy (on Ubuntu 24.04: sudo apt install ros-jazzy-ros-base), run "
        "'. /opt/ros/jazzy/setup.bash' and then this again"
    )
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize(("untried", "says"), [((3, 0), True), ((3, 99), False)])
def test_a_python_that_no_test_has_run_on_is_named(
    setup_environment: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    untried: tuple[int, int],
    says: bool,
) -> None:
    def fail(_ros: str) -> None:
        raise setup_environment.SetupError("as far as this")

    monkeypatch.setattr(setup_environment, "UNTRIED", untried)
    monkeypatch.setattr(setup_environment, "read", lambda _stamp: None)
    monkeypatch.setattr(setup_environment, "install_packages", fail)
    for name in ("VENV", "BUILD", "WORKSPACE_STAMP"):
        monkeypatch.setattr(setup_environment, name, tmp_path / name)
    with pytest.raises(setup_environment.SetupError, match="as far as this"):
        setup_environment.update("kilted")
    said = capsys.readouterr().out
    assert said.startswith("Setting up with Python ")
    assert "and ROS 2 Kilted from pinned wheels." in said
    assert ("  No test has run on this version of Python; all packages exist" in said) == says


def test_arm64_with_a_sourced_ros_is_set_up(
    setup_environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    setup_environment.check_prerequisites("system", packages=False)


@pytest.mark.wide
@pytest.mark.by_day
@pytest.mark.parametrize("kind", ["system", "system-extras", "system-build", "wheels"])
def test_a_lock_can_be_installed_on_arm64(
    setup_environment: ModuleType, kind: str, tmp_path: Path
) -> None:
    """That of the wheels without those of ROS, which are for x86-64 only."""
    text = (ROOT / f"requirements/{kind}.txt").read_text("utf-8")
    lock = tmp_path / "lock.txt"
    lock.write_text(re.sub(r"(?m)^ros-.*(\n +.*)*\n?", "", text), "utf-8")
    uv, variables = setup_environment.installer()
    command = [str(uv), "--no-config", "--system-certs", "pip", "install", "--dry-run"]
    command += [*setup_environment.options_of_lock(lock), "--target", str(tmp_path / "target")]
    command += ["--python-platform", "aarch64-manylinux_2_35", "-r", str(lock)]
    for version in ("3.10", "3.11", "3.12"):
        done = subprocess.run(
            [*command, "--python-version", version], env=variables, capture_output=True, text=True,
            timeout=HANGS_AFTER_S, check=False,
        )  # fmt: skip
        if re.search("Failed to fetch|error sending request", done.stderr):
            pytest.skip(f"no package index was reached: {done.stderr.strip().splitlines()[-1]}")
        assert done.returncode == 0, f"{version}: {done.stderr}"
        assert "+ ruckig==" in done.stderr or kind == "system-build", done.stderr


@pytest.mark.night
@pytest.mark.parametrize("layer", ["build", "dev"])
@pytest.mark.parametrize("ros", ["system", "wheels", "kilted"])
def test_a_lock_can_be_installed_on_each_python(
    setup_environment: ModuleType, ros: str, layer: str, tmp_path: Path
) -> None:
    lock = ROOT / f"requirements/{ros}-{layer}.txt"
    uv, variables = setup_environment.installer()
    command = [str(uv), "--no-config", "--system-certs", "pip", "install", "--dry-run"]
    command += [*setup_environment.options_of_lock(lock), "--target", str(tmp_path / "target")]
    # Nothing else is compiled where a Python is new.
    command += ["--only-binary=ruckig", "--python-platform", "x86_64-manylinux_2_35"]
    for version in ("3.10", "3.11", "3.12", "3.13", "3.14"):
        done = subprocess.run(
            [*command, "--python-version", version, "-r", str(lock)], env=variables,
            capture_output=True, text=True, timeout=HANGS_AFTER_S, check=False,
        )  # fmt: skip
        if re.search("Failed to fetch|error sending request", done.stderr):
            pytest.skip(f"no package index was reached: {done.stderr.strip().splitlines()[-1]}")
        assert done.returncode == 0, f"{version}: {done.stderr}"
        assert "Would install" in done.stderr


@pytest.mark.parametrize(
    ("headers", "lacks"),
    [
        (("init_options.h",), True),
        (("init_options.h", "discovery_options.h"), False),
        ((), False),
    ],
)
def test_a_ros_without_discovery_range_is_kept_on_this_machine_otherwise(
    setup_environment: ModuleType,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    headers: tuple[str, ...],
    lacks: bool,
) -> None:
    folder = tmp_path / "ros/include/rcl/rcl"
    folder.mkdir(parents=True)
    for name in headers:
        (folder / name).touch()
    for name, value in sourced(tmp_path / "ros", "humble").items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(setup_environment, "ENVIRONMENT_FILE", tmp_path / "environment.bash")
    setup_environment.record_environment("system")
    recorded = (tmp_path / "environment.bash").read_text("utf-8")
    assert "export ROS_DISTRO=humble" in recorded
    assert ("export ROS_LOCALHOST_ONLY=1\n" in recorded) == lacks


def test_missing_headers_are_named(
    setup_environment: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sysconfig.get_path", lambda _name: str(tmp_path))
    with pytest.raises(setup_environment.SetupError, match=r"headers of .*: sudo apt .*-dev$"):
        setup_environment.check_prerequisites("system")


def test_missing_venv_module_is_named(
    setup_environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(setup_environment, "base_interpreter", lambda: "/bin/false")
    with pytest.raises(setup_environment.SetupError, match=r"venv module .*: sudo apt .*-venv$"):
        setup_environment.check_prerequisites("system")


def test_interfaces_on_demand_are_built_once_and_not_where_ros_has_them(
    setup_environment: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps: list[str] = []
    forms: list[str] = []
    ros = tmp_path / "ros"
    monkeypatch.setattr(setup_environment, "INSTALL", tmp_path)
    monkeypatch.setattr(setup_environment, "BUILD", tmp_path / "build")
    monkeypatch.setattr(
        setup_environment, "base_environment", lambda _ros: {"AMENT_PREFIX_PATH": str(ros)}
    )

    def build(_ros: str, names: tuple[str, ...], prefix: Path, *_: Path, form: str = "") -> None:
        forms.append(form)
        steps.extend(names)
        prefix.mkdir()

    monkeypatch.setattr(setup_environment, "build_interfaces", build)
    monkeypatch.setattr(setup_environment, "record_environment", lambda *_: None)
    (name,) = setup_environment.ON_DEMAND
    assert setup_environment.add_interfaces("wheels", name)
    assert not setup_environment.add_interfaces("wheels", name)
    monkeypatch.setattr(setup_environment, "hash_of", lambda _paths: "another definition")
    assert setup_environment.add_interfaces("wheels", name)
    assert setup_environment.add_interfaces("wheels", name, "1.5")
    assert not setup_environment.add_interfaces("wheels", name, "1.5")
    (tmp_path / name / "interfaces.stamp").unlink()
    (ros / "share" / name).mkdir(parents=True)
    assert not setup_environment.add_interfaces("system", name)
    assert steps == [name, name, name]
    assert forms == ["", "", "1.5"]


def test_a_failed_step_leaves_what_was_there_and_nothing_half_made(
    setup_environment: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(setup_environment, "BUILD", tmp_path / "build")
    folder = tmp_path / "made"
    folder.mkdir()
    (folder / "old").touch()

    def fail() -> None:
        with setup_environment.replacing(folder):
            folder.mkdir()
            (folder / "new").touch()
            raise OSError("full")

    with pytest.raises(OSError, match="full"):
        fail()
    assert [path.name for path in tmp_path.rglob("*")] == ["made", "old"]
    with setup_environment.replacing(folder):
        folder.mkdir()
        (folder / "new").touch()
    assert [path.name for path in tmp_path.rglob("*")] == ["made", "new"]
    # Killed between: neither is lost.
    folder.rename(tmp_path / "made.before")
    with pytest.raises(OSError, match="full"):
        fail()
    assert [path.name for path in tmp_path.rglob("*")] == ["made", "new"]


def test_a_folder_that_is_added_to_is_as_it_was_after_a_failure(
    setup_environment: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(setup_environment, "BUILD", tmp_path / "build")
    folder = tmp_path / "made"
    (folder / "bin").mkdir(parents=True)
    (folder / "bin/python").symlink_to("/usr/bin/python3")
    (folder / "old").write_text("old")

    def add(failure: type[BaseException] | None) -> None:
        with setup_environment.replacing(folder, keeps_content=True):
            assert (folder / "old").read_text("utf-8") == "old"
            (folder / "new").touch()
            (folder / "bin/python").unlink()
            if failure is not None:
                raise failure("full")

    with pytest.raises(OSError, match="full"):
        add(OSError)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["bin", "made", "old", "python"]
    assert (folder / "bin/python").readlink() == Path("/usr/bin/python3")
    # Killed while it was added to: the next set-up puts it back.
    shutil.copytree(folder, tmp_path / "made.before", symlinks=True)
    (folder / "half").touch()
    setup_environment.put_back(tmp_path / "made.before")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["bin", "made", "old", "python"]
    add(None)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["bin", "made", "new", "old"]


def test_a_package_that_cannot_be_fetched_is_named_and_the_environment_stays(
    setup_environment: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    venv, lock = tmp_path / ".venv", tmp_path / "extras.txt"
    subprocess.run(
        [BASE_PYTHON, "-m", "venv", "--without-pip", venv], check=True, timeout=HANGS_AFTER_S
    )
    uv = shutil.which("uv")
    assert uv is not None, "it is one of the packages for development"
    (venv / "bin/uv").symlink_to(uv)
    lock.write_text(f"never-published==1.0 \\\n    --hash=sha256:{'0' * 64}\n")
    monkeypatch.setattr(setup_environment, "ROOT", tmp_path)
    monkeypatch.setattr(setup_environment, "VENV", venv)
    monkeypatch.setattr(setup_environment, "BUILD", tmp_path / "build")
    monkeypatch.setattr(setup_environment, "LOGS", tmp_path / "log")
    monkeypatch.setattr(setup_environment, "NEEDED_DISK_MB", 1)
    monkeypatch.setattr(setup_environment, "lock_of", lambda *_: lock)
    # Port 9, discard, has no server.
    for name, value in (
        ("PIP_INDEX_URL", "http://127.0.0.1:9/simple"), ("PIP_EXTRA_INDEX_URL", ""),
        ("UV_HTTP_RETRIES", "0"), ("UV_CACHE_DIR", str(tmp_path / "cache")), ("NO_PROXY", "*"),
    ):  # fmt: skip
        monkeypatch.setenv(name, value)
    for name in ("UV_DEFAULT_INDEX", "UV_INDEX", "UV_INDEX_URL"):  # they count before pip's
        monkeypatch.delenv(name, raising=False)
    before = sorted(venv.rglob("*"))
    with pytest.raises(setup_environment.SetupError) as caught:
        setup_environment.add_layer("wheels", "extras")
    said = str(caught.value)
    assert said.startswith("'Installing 1 pinned packages' ended with code")
    assert "127.0.0.1:9/simple/never-published/" in said
    assert "Connection refused" in said
    assert len(said.splitlines()) == 1
    assert sorted(venv.rglob("*")) == before
    assert {path.name for path in tmp_path.iterdir()} == {".venv", "cache", "extras.txt", "log"}
    assert "Installing 1 pinned packages" in capsys.readouterr().out


def test_a_missing_package_is_one_sentence_and_nothing_stays(fresh_clone: Path) -> None:
    lock = fresh_clone / "requirements/wheels-dev.txt"
    lock.write_text(lock.read_text("utf-8").replace("uv==", "uv==9999."), "utf-8")
    tools = {**commands("cc", "c++"), "python3": BASE_PYTHON}
    said = set_up_with(tools, fresh_clone, MAVBRIDGE_ROS="wheels")
    assert "Set-up failed: 'Fetching uv' ended with code 1" in said
    assert not (fresh_clone / "install/environment.bash").exists()


def test_a_full_disk_is_named_before_anything_begins(
    setup_environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(setup_environment, "NEEDED_DISK_MB", 10**9)
    with pytest.raises(
        setup_environment.SetupError, match=r"MB of free disk, and the set-up needs"
    ):
        setup_environment.check_prerequisites("system")


def test_a_cache_on_a_full_disk_of_its_own_is_named_too(
    setup_environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared_memory = Path("/dev/shm")
    if not shared_memory.is_dir() or shared_memory.stat().st_dev == ROOT.stat().st_dev:
        pytest.skip("this machine has no second file system to be the cache's")
    monkeypatch.setattr(setup_environment, "NEEDED_DISK_MB", 0)
    monkeypatch.setattr(setup_environment, "NEEDED_CACHE_MB", 10**9)
    monkeypatch.setenv("UV_CACHE_DIR", "/dev/shm/no/cache/yet")
    with pytest.raises(setup_environment.SetupError, match=r"^/dev/shm/no/cache/yet has \d+ MB"):
        setup_environment.check_prerequisites("system")


def test_uv_looks_where_pip_is_told_to_look(setup_environment: ModuleType) -> None:
    listed = "global.index-url='https://a/simple'\n:env:.index-url='https://b/simple'\n"
    listed += "global.find-links='/x\\n/y'\ninstall.user='true'\n"
    found = setup_environment.settings_of_pip(listed)
    assert found == {"UV_DEFAULT_INDEX": "https://b/simple", "UV_FIND_LINKS": "/x,/y"}


@pytest.mark.parametrize(
    ("log", "said"),
    [
        (
            "error: Request failed\n  cause: Failed to fetch: x\n  cause: y\n  cause: refused\n",
            "Request failed: Failed to fetch: x: refused",
        ),
        ("error: No solution\n  cause: No version of x\n", "No solution: No version of x"),
        (
            f"error: Failed\n  cause: cannot copy {'x' * 200}: No space left on device\n",
            f"Failed: cannot copy {'x' * 138}: No space left on device",
        ),
        (
            "WARNING: connection broken by 'Failed to z'\nERROR: No matching distribution for x\n",
            "No matching distribution for x; the package index was not reached",
        ),
        ("a.c:1: fatal error: x.h\nb\nc: No space left on device\n", "c: No space left on device"),
        ("a\nb.c:1: fatal error: x.h\n", "b.c:1: fatal error: x.h"),
        ("Reading\nE: Unable to locate package x\n", "Unable to locate package x"),
        ("a\nCMake Error at b:3 (c):\n\n  No d.\n\ne\n", "CMake Error at b:3 (c): No d."),
        ("one\ntwo\n", "one"),
    ],
)
def test_a_failed_program_is_quoted_by_its_reason(
    setup_environment: ModuleType, log: str, said: str
) -> None:
    assert setup_environment.reason(log) == f": {said}"


def test_a_wheel_of_the_interfaces_is_taken_only_where_it_fits(
    setup_environment: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MAVBRIDGE_WHEELS", str(tmp_path))
    tag = setup_environment.python_tag()
    names = [
        f"mavbridge_interfaces-{version}-{python}-{python}-manylinux_2_{libc}_x86_64.whl"
        for version, python, libc in (
            (setup_environment.wheel_version(), tag, "99"),
            (setup_environment.wheel_version(), "cp39", "17"),
            ("0.1.0+000000000000", tag, "17"),
            (setup_environment.wheel_version(), tag, "17_x86_64 (1)"),
            (setup_environment.wheel_version(), tag, "x"),
        )
    ]
    for name in names:
        (tmp_path / name).touch()
    assert setup_environment.fitting_wheel() is None
    fits = tmp_path / names[0].replace("_99_", "_17_")
    fits.touch()
    assert setup_environment.fitting_wheel() == fits
    with pytest.raises(setup_environment.SetupError, match="is damaged"):
        setup_environment.unpack(fits, tmp_path / "prefix")


def test_with_a_wheel_no_compiler_is_needed(
    setup_environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setattr("sysconfig.get_path", lambda _name: "/nowhere")
    setup_environment.check_prerequisites("system", compiles=False)


@pytest.mark.parametrize(
    ("version", "tag", "platform", "reason"),
    [
        ("", "", "manylinux_2_17_aarch64", "is for aarch64, and this is x86_64"),
        ("", "cp39", "manylinux_2_17_x86_64", "is for another Python, and this is cp3"),
        ("0.1.0+0", "", "manylinux_2_17_x86_64", "was made of other interfaces than "),
        ("", "", "manylinux_2_99_x86_64", "needs manylinux_2_99, and this has "),
        ("", "", "any", "is not named as such a wheel is"),
    ],
)
def test_why_a_wheel_does_not_fit_is_said_where_there_is_no_compiler(
    setup_environment: ModuleType,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    version: str,
    tag: str,
    platform: str,
    reason: str,
) -> None:
    python = tag or setup_environment.python_tag()
    name = f"{version or setup_environment.wheel_version()}-{python}-{python}-{platform}.whl"
    (tmp_path / f"mavbridge_interfaces-{name}").touch()
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    monkeypatch.setenv("MAVBRIDGE_WHEELS", str(tmp_path))
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(setup_environment.SetupError) as e:
        setup_environment.check_prerequisites("wheels", packages=False)
    said = str(e.value)
    assert f"wheel of the interfaces that fits: mavbridge_interfaces-{name} {reason}" in said
    assert len(said.splitlines()) == 1
    # Those of Jazzy do not fit Kilted, and beside a sourced ROS none is used.
    reason = reason if platform == "any" else "is for ROS 2 Jazzy, and this is Kilted"
    assert setup_environment.misfits("kilted") == f"mavbridge_interfaces-{name} {reason}"
    with pytest.raises(setup_environment.SetupError) as e:
        setup_environment.check_prerequisites("system", packages=False)
    assert "wheel" not in str(e.value)


def test_arm64_without_a_compiler_is_one_sentence(
    setup_environment: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    monkeypatch.setenv("CC", "no-such-compiler")
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(setup_environment.SetupError) as e:
        setup_environment.check_prerequisites("system", packages=False)
    assert str(e.value) == (
        "There is no no-such-compiler (the C compiler), there is no no-such-compiler (the C++ "
        "compiler): sudo apt install build-essential"
    )


@pytest.mark.parametrize(
    ("log", "doing"),
    [
        ("", ""),
        ("-- Found x\n-- Configuring done (4.1s)\n", "Configuring done"),
        ("-- Configuring done (4.1s)\n[ 3/57] Building C object\n", "[ 3/57]"),
    ],
)
def test_the_set_up_reports_what_it_does(
    setup_environment: ModuleType, log: str, doing: str
) -> None:
    assert setup_environment.progress(log) == doing


def test_entries_of_the_project_are_taken_out_of_an_environment(
    setup_environment: ModuleType,
) -> None:
    before = {"PATH": "/w/.venv/bin:/usr/bin:/w/.venv2/bin", "PYTHONPATH": "/w/.venv", "X": "/w"}
    after = setup_environment.without_folders(before, ["/w/.venv"])
    assert after == {"PATH": "/usr/bin:/w/.venv2/bin", "PYTHONPATH": "", "X": "/w"}


@pytest.mark.parametrize("python", ["no-such-python", "/bin/false"])
def test_chosen_python_that_does_not_fit_is_rejected(fresh_clone: Path, python: str) -> None:
    said = set_up_with(commands("cc", "c++"), fresh_clone, PYTHON=python)
    assert f"PYTHON is '{python}', which is not a working Python 3.10 to 3.14" in said


@pytest.mark.parametrize(
    ("variables", "kind"),
    [
        ({}, "wheels"),
        ({"MAVBRIDGE_ROS": "jazzy"}, "wheels"),
        ({"MAVBRIDGE_ROS": "kilted"}, "kilted"),
        ({"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": "/r", "MAVBRIDGE_ROS": "wheels"}, "wheels"),
        ({"ROS_DISTRO": "ardent", "MAVBRIDGE_ROS": "wheels"}, "wheels"),
    ],
)
def test_kind_of_ros_follows_the_shell(
    variables: dict[str, str], kind: str, fresh_clone: Path
) -> None:
    result = bash(". scripts/ros_kind.sh && mavbridge_ros_kind", variables, fresh_clone)
    assert (result.returncode, result.stdout, result.stderr) == (0, f"{kind}\n", "")


def sourced(folder: Path, distribution: str, python: str = "3.12") -> dict[str, str]:
    """Makes as much of a ROS as the set-up looks at; returns what sourcing it sets."""
    modules = folder / "lib" / f"python{python}" / "site-packages"
    (modules / "rclpy").mkdir(parents=True)
    (folder / "share/rclpy").mkdir(parents=True)
    return {
        "ROS_DISTRO": distribution,
        "AMENT_PREFIX_PATH": f"/own/workspace:{folder}",
        "PYTHONPATH": f"/own/modules:{modules}",
    }


@pytest.mark.parametrize("name", ["humble", "jazzy", "kilted", "lyrical", "rolling"])
@pytest.mark.parametrize("chosen", ["", "system"])
def test_each_living_distribution_may_be_sourced(name: str, chosen: str, tmp_path: Path) -> None:
    variables = {**sourced(tmp_path, name), "MAVBRIDGE_ROS": chosen}
    result = bash("set -euo pipefail; . scripts/ros_kind.sh; mavbridge_ros_kind", variables)
    assert (result.returncode, result.stdout, result.stderr) == (0, "system\n", "")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"AMENT_PREFIX_PATH": ""}, "'jazzy', but no ROS is sourced (AMENT_PREFIX_PATH is empty)"),
        ({"AMENT_PREFIX_PATH": "/own/workspace"}, "(no folder of AMENT_PREFIX_PATH has rclpy)"),
        ({"PYTHONPATH": ""}, "(no folder of PYTHONPATH has rclpy): run '. /opt/ros/jazzy/setup"),
        ({"ROS_DISTRO": "iron"}, "but this project is for humble, jazzy, kilted, lyrical, rolling"),
    ],
)
def test_a_workspace_that_is_sourced_in_part_is_one_sentence(
    change: dict[str, str], said: str, tmp_path: Path
) -> None:
    variables = {**sourced(tmp_path, "jazzy"), **change}
    for script in ("scripts/setup.sh", ". scripts/ros_kind.sh; mavbridge_ros_kind"):
        result = bash(script, variables)
        assert result.returncode == 1
        assert said in result.stderr
        assert len(result.stderr.strip().splitlines()) == 1


def test_a_ros_of_another_python_is_one_sentence(fresh_clone: Path, tmp_path: Path) -> None:
    other = "3.10" if sys.version_info[:2] != (3, 10) else "3.11"
    said = set_up_with(
        {**commands("cc", "c++"), "python3": BASE_PYTHON},
        fresh_clone,
        **sourced(tmp_path / "ros", "humble", other),
    )
    assert said == (
        f"No Python {other} (the sourced ROS was made for it) was found: sudo apt install "
        f"python{other} python{other}-dev python{other}-venv, or name one with "
        "PYTHON=/path/to/python3.\n"
    )


def test_a_folder_stays_on_the_wheels_that_it_was_set_up_on(fresh_clone: Path) -> None:
    (fresh_clone / "install").mkdir()
    for made_for, kind in (("kilted", "kilted"), ("wheels", "wheels"), ("system", "wheels")):
        (fresh_clone / "install/environment.bash").write_text(f"# for {made_for}\n")
        script = "set -euo pipefail; . scripts/ros_kind.sh; mavbridge_ros_kind"
        assert bash(script, cwd=fresh_clone).stdout == f"{kind}\n"
    (fresh_clone / "install/environment.bash").write_text("# for kilted\n")
    chosen = bash(script, {"MAVBRIDGE_ROS": "jazzy"}, fresh_clone)
    assert chosen.stdout == "wheels\n"


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"ROS_DISTRO": "ardent"}, "ROS_DISTRO is 'ardent', but this project is for humble, jazzy"),
        ({"MAVBRIDGE_ROS": "system"}, "needs a sourced ROS 2: run '. /opt/ros/jazzy/setup.bash'"),
        ({"MAVBRIDGE_ROS": "apt"}, "must be 'wheels', 'jazzy', 'kilted' or 'system'"),
    ],
)
def test_contradiction_about_ros_is_one_sentence(variables: dict[str, str], said: str) -> None:
    for script in ("scripts/setup.sh", "source ./setup.bash"):
        result = bash(script, variables)
        assert result.returncode == 1
        assert said in result.stderr
        assert len(result.stderr.strip().splitlines()) == 1


# --- The environment ---


def test_environment_enters_strict_shells_twice_from_anywhere(tmp_path: Path) -> None:
    enter = f"source '{ROOT}/setup.bash'"
    script = f"""
        set -euo pipefail
        {enter}; once=$(env | grep -v '^_=' | sort)
        {enter}; twice=$(env | grep -v '^_=' | sort)
        [ "$once" = "$twice" ]
        command -v navigation_server navigation_client tlog_export python
        python -c 'import custom_interfaces.action, drone_navigation, mavlink_sitl, rclpy'
        echo "$ROS_AUTOMATIC_DISCOVERY_RANGE"
    """
    result = bash(script, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    executables = ROOT / "install/packages/lib/drone_navigation"
    assert result.stdout.splitlines() == [
        f"{executables}/navigation_server",
        f"{executables}/navigation_client",
        f"{ROOT}/install/packages/lib/flight_logs/tlog_export",
        f"{ROOT}/.venv/bin/python",
        "LOCALHOST",
    ]


def test_environment_keeps_what_was_chosen_before() -> None:
    script = 'source ./setup.bash; echo "$ROS_AUTOMATIC_DISCOVERY_RANGE ${PATH##*:}"'
    result = bash(script, {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF", "PATH": "/usr/bin:/bin:/own"})
    assert result.stdout == "OFF /own\n"


def test_environment_of_a_fresh_clone_names_the_command_to_run(fresh_clone: Path) -> None:
    shutil.copy(ROOT / "setup.bash", fresh_clone)
    result = bash("source ./setup.bash", {"MAVBRIDGE_ROS": "wheels"}, fresh_clone)
    assert result.returncode == 1
    assert "run 'make setup'" in result.stderr


@pytest.mark.parametrize(
    ("variables", "enters"),
    [
        ({}, True),
        # A container's image names its distribution, sourced or not.
        ({"ROS_DISTRO": "jazzy"}, True),
        ({"AMENT_PREFIX_PATH": "/other/clone/.venv"}, True),
        ({"MAVBRIDGE_ROS": "wheels"}, False),
        ({"MAVBRIDGE_ROS": "system"}, False),
        ({"ROS_DISTRO": "jazzy", "AMENT_PREFIX_PATH": "/nothing/there"}, False),
    ],
)
def test_environment_of_a_sourced_ros_is_entered_from_shells_without_it(
    fresh_clone: Path, variables: dict[str, str], enters: bool
) -> None:
    shutil.copy(ROOT / "setup.bash", fresh_clone)
    (fresh_clone / "install").mkdir()
    (fresh_clone / "install/environment.bash").write_text("# for system\necho entered\n")
    result = bash("set -euo pipefail; source ./setup.bash", variables, fresh_clone)
    assert result.stdout == ("entered\n" if enters else "")
    assert len(result.stderr.splitlines()) == (0 if enters else 1)


def test_other_ros_does_not_reach_an_environment_made_from_wheels() -> None:
    if ROS_KIND == "system":
        pytest.skip("set up on a sourced ROS")
    foreign = dict.fromkeys(("AMENT_PREFIX_PATH", "PYTHONPATH"), "/opt/ros/humble")
    foreign |= {"ROS_DISTRO": "humble", "MAVBRIDGE_ROS": ROS_KIND}
    result = bash("source ./setup.bash; env", foreign)
    assert "VIRTUAL_ENV=" in result.stdout
    assert "humble" not in result.stdout


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("navigation_client ta", "takeoff"),
        ("navigation_client land --ser", "--server-timeout"),
        ("navigation_client --plan READ", "README.md"),
        ("navigation_server --che", "--check"),
        ("tlog_export --t", "--to"),
    ],
)
def test_an_interactive_shell_completes_the_commands(typed: str, offered: str) -> None:
    script = f"""
        . ./setup.bash
        COMP_WORDS=({typed}) COMP_CWORD=$(({len(typed.split())} - 1))
        "$(complete -p {typed.split(maxsplit=1)[0]} | sed 's/.*-F //; s/ .*//')"
        echo "${{COMPREPLY[@]}}"
    """
    done = bash(f"bash --norc -i -c {shlex.quote(script)}")
    assert done.stdout.split() == [offered], done.stderr
