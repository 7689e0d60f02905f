"""The readings of this computer, from files as Linux has them on several computers."""

from __future__ import annotations

from pathlib import Path

import pytest

from mavlink_vehicle.io.this_computer import (
    ComputerReader,
    Heat,
    read_heat,
    read_memory_bytes,
    read_model,
)

STAT = "cpu  100 0 100 1000 0 0 0 0 0 0\ncpu0 {0} 0 50 {1} 10 0 0 0 5 0\ncpu1 10 0 10 {2} 0 0 0 0\n"


def write(root: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return root


def zone(number: int, kind: str, temp: str, **trips: str) -> dict[str, str]:
    folder = f"sys/class/thermal/thermal_zone{number}"
    files = {f"{folder}/type": f"{kind}\n", f"{folder}/temp": f"{temp}\n"}
    for index, (trip, celsius) in enumerate(trips.items()):
        files[f"{folder}/trip_point_{index}_type"] = f"{trip}\n"
        files[f"{folder}/trip_point_{index}_temp"] = f"{celsius}\n"
    return files


def cooling(number: int, kind: str, state: int) -> dict[str, str]:
    folder = f"sys/class/thermal/cooling_device{number}"
    return {f"{folder}/type": f"{kind}\n", f"{folder}/cur_state": f"{state}\n"}


def test_a_computer_that_reports_nothing_is_unknown(tmp_path: Path) -> None:
    reader = ComputerReader(tmp_path / "missing", tmp_path)
    status = reader.read()
    assert status.uptime_s is status.ram_total_bytes is status.temperature_c is None
    assert status.storage_total_bytes is None
    assert status.core_loads == ()
    assert read_heat(tmp_path) == Heat()
    assert read_model(tmp_path) == ""


def test_loads_are_those_since_the_last_reading(tmp_path: Path) -> None:
    root = write(tmp_path, {"proc/stat": STAT.format(100, 1000, 500)})
    reader = ComputerReader(root=root)
    write(root, {"proc/stat": STAT.format(150, 1050, 700)})
    assert reader.read().core_loads == pytest.approx((0.5, 0.0))
    write(root, {"proc/stat": STAT.format(250, 1050, 700)})
    assert reader.read().core_loads == pytest.approx((1.0,))


def test_memory_that_programs_can_get_is_not_in_use(tmp_path: Path) -> None:
    text = "MemTotal:  8000000 kB\nMemFree:  100 kB\nMemAvailable:  6000000 kB\nHugePages: x\n"
    root = write(tmp_path, {"proc/meminfo": text, "proc/uptime": "350.25 600.00\n"})
    assert read_memory_bytes(root) == (8_192_000_000, 6_144_000_000)
    status = ComputerReader(root, root).read()
    assert status.ram_used_bytes == 2_048_000_000
    assert status.uptime_s == 350.25
    assert status.storage_total_bytes is not None
    assert status.storage_used_bytes is not None
    assert 0 < status.storage_used_bytes <= status.storage_total_bytes


def test_the_hottest_zone_counts_and_a_fan_is_no_throttling(tmp_path: Path) -> None:
    """As of a Raspberry Pi 5, whose fan is a cooling device, too."""
    files = {
        **zone(0, "cpu-thermal", "61250", active="50000", passive="85000", critical="110000"),
        **cooling(0, "pwm-fan", 3),
        **cooling(1, "cpufreq-cpu0", 0),
    }
    heat = read_heat(write(tmp_path, files))
    assert heat == Heat(61.25, "cpu-thermal", 85.0, False)


def test_a_processor_that_is_slowed_down_is_seen(tmp_path: Path) -> None:
    """As of a Jetson, where zones that are off have no value, or one that cannot be."""
    files = {
        **zone(0, "PMIC-Die", "-256000"),
        **zone(1, "CPU-therm", "97500", passive="97000", critical="102000"),
        **zone(2, "GPU-therm", "not a number"),
        **cooling(0, "thermal-cpufreq-0", 2),
    }
    heat = read_heat(write(tmp_path, files))
    assert heat == Heat(97.5, "CPU-therm", 97.0, True)


def test_a_zone_that_cannot_be_read_is_left_out(tmp_path: Path) -> None:
    root = write(tmp_path, zone(0, "cpu-thermal", "50000"))
    (root / "sys/class/thermal/thermal_zone1/temp").mkdir(parents=True)
    assert read_heat(root).hottest_c == 50.0


def test_the_model_is_the_boards_else_the_processors(tmp_path: Path) -> None:
    root = write(tmp_path, {"proc/cpuinfo": "processor : 0\nmodel name : Some  CPU @ 3 GHz\n"})
    assert read_model(root) == "Some CPU @ 3 GHz"
    write(root, {"proc/device-tree/model": "Raspberry Pi 5 Model B Rev 1.0\0"})
    assert read_model(root) == "Raspberry Pi 5 Model B Rev 1.0"


def test_this_computer_is_read() -> None:
    """Linux reports these everywhere."""
    status = ComputerReader().read()
    assert status.uptime_s is not None
    assert status.uptime_s > 0.0
    assert status.ram_used_bytes is not None
    assert status.ram_total_bytes is not None
    assert 0 < status.ram_used_bytes < status.ram_total_bytes
