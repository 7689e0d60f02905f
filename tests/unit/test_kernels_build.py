"""The compilation of navigation_kernels, and its library found, by the set-up and by colcon."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

from tests.support.processes import HANGS_AFTER_S

ROOT = Path(__file__).resolve().parents[2]
KERNELS = ROOT / "src/navigation_kernels"


@pytest.fixture
def setup_environment() -> ModuleType:
    path = ROOT / "scripts/setup_environment.py"
    spec = importlib.util.spec_from_file_location("setup_environment_of_kernels", path)
    if spec is None or spec.loader is None:
        raise ImportError(path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_colcon_compiles_with_the_flags_of_the_set_up(setup_environment: ModuleType) -> None:
    text = (KERNELS / "CMakeLists.txt").read_text("utf-8")
    (options,) = re.findall(r"target_compile_options\(\S+ PRIVATE (.*)\)", text)
    (standard,) = re.findall(r"set\(CMAKE_CXX_STANDARD (\d+)\)", text)
    # CMake adds the last two for a shared library.
    expected = [f"-std=c++{standard}", *options.split(), "-fPIC", "-shared"]
    assert list(setup_environment.KERNELS_FLAGS) == expected


def test_a_change_of_a_source_is_compiled_again(
    setup_environment: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "kernels"
    shutil.copytree(KERNELS / "kernels", copy)
    monkeypatch.setattr(setup_environment, "ROOT", tmp_path)
    monkeypatch.setattr(setup_environment, "KERNELS_SOURCES", copy)
    before = setup_environment.key_of_kernels()
    assert setup_environment.key_of_kernels() == before
    with (copy / "shapes.hpp").open("a", encoding="utf-8") as header:
        header.write("\n")
    assert setup_environment.key_of_kernels() != before


def test_the_library_is_taken_from_a_wheel(setup_environment: ModuleType, tmp_path: Path) -> None:
    wheel, name = tmp_path / "some.whl", setup_environment.KERNELS_LIBRARY
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr(f"navigation_kernels/{name}", b"library")
        archive.writestr("custom_interfaces/__init__.py", b"")
    setup_environment.take_kernels(wheel, tmp_path / "kernels")
    assert (tmp_path / "kernels" / name).read_bytes() == b"library"
    # The package beside it is linked from the sources.
    setup_environment.unpack(wheel, tmp_path / "interfaces")
    found = [path.name for path in (tmp_path / "interfaces").rglob("*") if path.is_file()]
    assert found == ["__init__.py"]


def test_a_wheel_without_the_library_is_one_sentence(
    setup_environment: ModuleType, tmp_path: Path
) -> None:
    wheel = tmp_path / "some.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        archive.writestr("custom_interfaces/__init__.py", b"")
    with pytest.raises(setup_environment.SetupError, match="is damaged"):
        setup_environment.take_kernels(wheel, tmp_path / "kernels")


def test_without_its_library_the_package_names_the_remedy(tmp_path: Path) -> None:
    package = tmp_path / "navigation_kernels"
    package.mkdir()
    shutil.copy(KERNELS / "navigation_kernels/__init__.py", package)
    command = [sys.executable, "-c", "import sys; sys.path[0] = '.'; import navigation_kernels"]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=HANGS_AFTER_S
    )
    said = done.stderr.strip().splitlines()[-1]
    assert said.startswith("ImportError: The compiled part of navigation_kernels cannot be loaded")
    assert said.endswith("'make setup' or 'colcon build' builds it.")
