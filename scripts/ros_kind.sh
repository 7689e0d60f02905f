# Determines the ROS installation for this shell. Sourced by setup.bash and by scripts/setup.sh.

# Distributions whose ROS may be sourced: those that MAVROS and Nav2 are released for.
MAVBRIDGE_DISTRIBUTIONS="humble jazzy kilted lyrical rolling"

# Prints "wheels" (ROS 2 Jazzy from the pinned wheels), "kilted" (the same of Kilted) or "system"
# (the ROS 2 that is sourced in this shell). MAVBRIDGE_ROS overrides; without it and without a sourced
# ROS, a folder that was set up on Kilted's wheels stays so. On a contradiction: one sentence on
# stderr, status 1.
mavbridge_ros_kind() {
    local file made_for=
    case "${MAVBRIDGE_ROS:-}" in
    wheels | jazzy)
        echo wheels
        ;;
    kilted)
        echo kilted
        ;;
    system)
        if [ -z "${ROS_DISTRO:-}" ] || [ -z "${AMENT_PREFIX_PATH:-}" ]; then
            echo "MAVBRIDGE_ROS=system needs a sourced ROS 2: run '. /opt/ros/jazzy/setup.bash' first, or that of your distribution." >&2
            return 1
        fi
        mavbridge_sourced_ros
        ;;
    "")
        if [ -n "${ROS_DISTRO:-}" ]; then
            mavbridge_sourced_ros
            return
        fi
        file=$(readlink -f "${BASH_SOURCE[0]}") || return 1
        { read -r _ _ made_for <"${file%/scripts/*}/install/environment.bash"; } 2>/dev/null || true
        if [ "$made_for" = kilted ]; then echo kilted; else echo wheels; fi
        ;;
    *)
        echo "MAVBRIDGE_ROS is '${MAVBRIDGE_ROS}', but must be 'wheels', 'jazzy', 'kilted' or 'system'." >&2
        return 1
        ;;
    esac
}

# Prints "system" if the sourced ROS is a whole one that is known.
mavbridge_sourced_ros() {
    local names=${MAVBRIDGE_DISTRIBUTIONS// /, } lacks=""
    if [[ " $MAVBRIDGE_DISTRIBUTIONS " != *" $ROS_DISTRO "* ]]; then
        echo "ROS_DISTRO is '$ROS_DISTRO', but this project is for $names: use a shell without it, or set MAVBRIDGE_ROS=wheels to ignore it." >&2
        return 1
    fi
    if [ -z "${AMENT_PREFIX_PATH:-}" ]; then
        echo "ROS_DISTRO is '$ROS_DISTRO', but no ROS is sourced (AMENT_PREFIX_PATH is empty): run '. /opt/ros/$ROS_DISTRO/setup.bash' first, or set MAVBRIDGE_ROS=wheels to do without it." >&2
        return 1
    fi
    mavbridge_has "$AMENT_PREFIX_PATH" share/rclpy || lacks=AMENT_PREFIX_PATH
    [ "$lacks" ] || mavbridge_has "${PYTHONPATH:-}" rclpy || lacks=PYTHONPATH
    if [ "$lacks" ]; then
        echo "ROS 2 $ROS_DISTRO is sourced in part only (no folder of $lacks has rclpy): run '. /opt/ros/$ROS_DISTRO/setup.bash' in a new shell, then your workspace's, or set MAVBRIDGE_ROS=wheels to ignore it." >&2
        return 1
    fi
    echo system
}

# Whether one of the folders of a list separated by colons has a folder.
mavbridge_has() {
    local rest="$1:"
    while [ "$rest" ]; do
        [ ! -d "${rest%%:*}/$2" ] || return 0
        rest=${rest#*:}
    done
    return 1
}
