"""Settings of Fast DDS that a server brings along: when they apply, and that they save memory."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from drone_navigation.process_control.fast_dds import small_histories
from drone_navigation.processes import free_domain
from tests.support.processes import HANGS_AFTER_S

READERS = 50
GROWTH = f"""
from pathlib import Path
import rclpy
from std_msgs.msg import String

def resident_kb():
    return int(Path("/proc/self/statm").read_text("ascii").split()[1]) * 4

rclpy.init()
node = rclpy.create_node("readers")
def subscribe(name):
    node.create_subscription(String, name, print, 10)
subscribe("first")
before_kb = resident_kb()
for number in range({READERS}):
    subscribe(f"topic_{{number}}")
print(resident_kb() - before_kb)
"""


def test_what_the_user_has_set_is_left_alone(tmp_path: Path) -> None:
    ours = small_histories({}, tmp_path)
    assert len(ours) == 2
    for name in (*ours, "FASTDDS_DEFAULT_PROFILES_FILE"):
        assert small_histories({name: "/the/users.xml"}, tmp_path) == {}
    (tmp_path / "DEFAULT_FASTRTPS_PROFILES.xml").touch()
    assert small_histories({}, tmp_path) == {}


def test_fast_dds_3_has_another_name_for_the_file(tmp_path: Path) -> None:
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "libfastdds.so.3.2").touch()
    variables = small_histories({"AMENT_PREFIX_PATH": f"/elsewhere:{tmp_path}"}, tmp_path)
    assert "FASTDDS_DEFAULT_PROFILES_FILE" in variables
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" not in variables


@pytest.mark.wide
def test_readers_keep_no_memory_for_messages_that_have_not_come(tmp_path: Path) -> None:
    ros = {"AMENT_PREFIX_PATH": os.environ["AMENT_PREFIX_PATH"]}
    variables = small_histories(ros, tmp_path)
    environment = {name: text for name, text in os.environ.items() if name not in variables}
    environment["ROS_DOMAIN_ID"] = str(free_domain(os.getpid()))
    grown_kb = []
    for added in ({}, variables):
        done = subprocess.run(
            [sys.executable, "-c", GROWTH], env={**environment, **added}, check=True,
            capture_output=True, text=True, timeout=HANGS_AFTER_S,
        )  # fmt: skip
        assert done.stderr == ""
        grown_kb.append(int(done.stdout))
    assert grown_kb[1] < 0.7 * grown_kb[0], grown_kb
