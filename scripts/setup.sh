#!/usr/bin/env bash
# Sets up everything the project needs, in .venv, build and install at the repository root.
#
# Finds a Python interpreter, then runs setup_environment.py. A second run without changes does
# nothing.
#
#   scripts/setup.sh --with nav2_msgs   also builds the interfaces of Nav2, which take a minute
#
#   PYTHON=python3.12       use this interpreter (3.10 to 3.14)
#   MAVBRIDGE_ROS=wheels    ROS 2 Jazzy from pinned wheels (also: jazzy)
#   MAVBRIDGE_ROS=kilted    ROS 2 Kilted from pinned wheels
#   MAVBRIDGE_ROS=system    the sourced ROS 2
set -u

script=$(readlink -f "${BASH_SOURCE[0]}") || exit 1
root=${script%/scripts/*}
# shellcheck source=ros_kind.sh
. "$root/scripts/ros_kind.sh"

# An interpreter fits when it is new and old enough and, beside a sourced ROS, of the version
# that this ROS was compiled for.
readonly fits='
import os, sys
version = sys.version_info[:2]
rclpy = [p for p in os.environ.get("PYTHONPATH", "").split(":") if os.path.isdir(p + "/rclpy")]
made_for_it = not rclpy or "/python%d.%d/" % version in rclpy[0] + "/"
sys.exit(not ((3, 10) <= version <= (3, 14) and (sys.argv[1] != "system" or made_for_it)))
'

fits() {
    command -v "$1" >/dev/null && "$1" -I -S -c "$fits" "$kind" >/dev/null 2>&1
}

# Prints the version of Python that the sourced ROS was made for, if its folder names one.
ros_python() {
    local folder folders
    IFS=: read -r -a folders <<<"${PYTHONPATH:-}"
    for folder in "${folders[@]}"; do
        if [ -d "$folder/rclpy" ] && [[ "$folder/" =~ /python(3\.[0-9]+)/ ]]; then
            echo "${BASH_REMATCH[1]}"
            return
        fi
    done
}

find_python() {
    local candidate wanted="Python 3.10 to 3.14" package=python3 version
    if [ "$kind" = system ]; then
        version=$(ros_python)
        package=python${version:-3}
        wanted="Python ${version:-3.10 to 3.14} (the sourced ROS was made for it)"
    fi
    if [ -n "${PYTHON:-}" ]; then
        if fits "$PYTHON"; then
            echo "$PYTHON"
            return 0
        fi
        echo "PYTHON is '$PYTHON', which is not a working $wanted." >&2
        return 1
    fi
    for candidate in "$root/.venv/bin/python" python3 python3.12 python3.11 python3.13 python3.10 python3.14; do
        if fits "$candidate"; then
            echo "$candidate"
            return 0
        fi
    done
    echo "No $wanted was found: sudo apt install $package $package-dev $package-venv," \
        "or name one with PYTHON=/path/to/python3." >&2
    return 1
}

kind=$(mavbridge_ros_kind) || exit 1
python=$(find_python) || exit 1
exec "$python" -I -S "$root/scripts/setup_environment.py" --ros "$kind" "$@"
