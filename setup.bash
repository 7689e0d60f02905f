# Enters the environment of the project: source setup.bash
#
# Works with bash, from any folder, as often as you like. Made by `make setup`.

_mavbridge_root=$(cd "${BASH_SOURCE[0]%/*}" 2>/dev/null && pwd -P || pwd -P)

# Puts entries in front of a colon-separated variable, moving those that are there already.
_mavbridge_prepend() {
    local rest=":${!1:-}:" entry
    local IFS=:
    for entry in $2; do
        rest=${rest//":$entry:"/":"}
    done
    rest=${rest#:}
    rest=${rest%:}
    export "$1=$2${rest:+:$rest}"
}

_mavbridge_enter() {
    local kind
    . "$_mavbridge_root/scripts/ros_kind.sh"
    kind=$(mavbridge_ros_kind) || return 1
    if [ ! -r "$_mavbridge_root/install/environment.bash" ]; then
        echo "Nothing is set up yet: run 'make setup' in $_mavbridge_root first." >&2
        return 1
    fi
    . "$_mavbridge_root/install/environment.bash"
    export ROS_AUTOMATIC_DISCOVERY_RANGE="${ROS_AUTOMATIC_DISCOVERY_RANGE:-LOCALHOST}"
}

_mavbridge_enter
