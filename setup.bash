# Enters the environment of the project: source setup.bash
#
# For bash, from any folder, as often as you like. `make setup` makes what this enters.

# Puts entries in front of a colon-separated variable; those that were there already move.
_mavbridge_prepend() {
    local rest=":${!1:-}:" entry IFS=:
    for entry in $2; do
        rest=${rest//":$entry:"/":"}
    done
    rest=${rest#:}
    rest=${rest%:}
    export "$1=$2${rest:+:$rest}"
}

_mavbridge_enter() {
    local root kind made_for
    root=$(readlink -f "${BASH_SOURCE[0]}") || return 1
    root=${root%/*}
    . "$root/scripts/ros_kind.sh"
    if ! { read -r _ _ made_for <"$root/install/environment.bash"; } 2>/dev/null; then
        echo "Nothing is set up here yet: run 'make setup' in $root." >&2
        return 1
    fi
    # Made for a sourced ROS, it brings that ROS along, so a shell without any will do.
    if [ "$made_for${MAVBRIDGE_ROS:-}" = system ] &&
        [[ -z "${ROS_DISTRO:-}" || -z "${AMENT_PREFIX_PATH:-}" ]]; then
        kind=system
    else
        kind=$(mavbridge_ros_kind) || return 1
    fi
    if [ "$made_for" != "$kind" ]; then
        echo "This is set up for ROS of the kind '$made_for', but this shell calls for '$kind':" \
            "run 'make setup' here, or set MAVBRIDGE_ROS=$made_for." >&2
        return 1
    fi
    . "$root/install/environment.bash"
    # SUBNET is what sourcing ROS sets by itself, so not yet anyone's decision. Whoever wants
    # the nodes to be found from other machines sets it after this.
    case "$made_for:${ROS_AUTOMATIC_DISCOVERY_RANGE:-}" in
    *: | system:SUBNET) export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ;;
    esac
    case $- in
    *i*) . "$root/install/completion.bash" ;;
    esac
}

_mavbridge_enter
