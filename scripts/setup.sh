#!/usr/bin/env bash
# Sets up all that the project needs, in .venv, build and install at the repository root.
#
# Finds a Python, then hands over to setup_environment.py. Run again, it does nothing when
# nothing has changed.
#
#   PYTHON=python3.12    use this interpreter (3.10 to 3.13)
#   MAVBRIDGE_ROS=wheels|system   ROS 2 from pinned wheels, or the sourced Jazzy
set -u

root=$(cd "${BASH_SOURCE[0]%/*}/.." && pwd -P) || exit 1
# shellcheck source=ros_kind.sh
. "$root/scripts/ros_kind.sh"

readonly supported='import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))'

is_supported() { "$1" -I -S -c "$supported" >/dev/null 2>&1; }

find_python() {
    local candidate
    if [ -n "${PYTHON:-}" ]; then
        if ! command -v "$PYTHON" >/dev/null; then
            echo "PYTHON is '$PYTHON', which is not a command." >&2
        elif is_supported "$PYTHON"; then
            command -v "$PYTHON"
            return 0
        else
            echo "PYTHON is '$PYTHON', which is not a working Python 3.10 to 3.13." >&2
        fi
        return 1
    fi
    for candidate in "$root/.venv/bin/python" python3 python3.12 python3.11 python3.13 python3.10; do
        if command -v "$candidate" >/dev/null && is_supported "$candidate"; then
            command -v "$candidate"
            return 0
        fi
    done
    echo "No Python 3.10 to 3.13 was found: install the package python3 (sudo apt install python3 python3-venv python3-dev)," \
        "or name an interpreter with PYTHON=/path/to/python3." >&2
    return 1
}

kind=$(mavbridge_ros_kind) || exit 1
python=$(find_python) || exit 1
exec "$python" -I -S "$root/scripts/setup_environment.py" --ros "$kind"
