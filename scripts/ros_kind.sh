# Determines the ROS installation for this shell. Sourced by setup.bash and by scripts/setup.sh.

# Prints "wheels" (ROS 2 from the pinned wheels) or "system" (the ROS 2 Jazzy that is sourced
# in this shell). MAVBRIDGE_ROS overrides. On a contradiction: one sentence on stderr, status 1.
mavbridge_ros_kind() {
    case "${MAVBRIDGE_ROS:-}" in
    wheels)
        echo wheels
        ;;
    system)
        if [ "${ROS_DISTRO:-}" != jazzy ] || [ -z "${AMENT_PREFIX_PATH:-}" ]; then
            echo "MAVBRIDGE_ROS=system needs a sourced ROS 2 Jazzy: run '. /opt/ros/jazzy/setup.bash' first." >&2
            return 1
        fi
        echo system
        ;;
    "")
        if [ "${ROS_DISTRO:-}" = jazzy ] && [ -n "${AMENT_PREFIX_PATH:-}" ]; then
            echo system
        elif [ -n "${ROS_DISTRO:-}" ] && [ "${ROS_DISTRO:-}" != jazzy ]; then
            echo "ROS 2 ${ROS_DISTRO} is sourced, but this project is for Jazzy: use a shell without it, or set MAVBRIDGE_ROS=wheels to ignore it." >&2
            return 1
        else
            echo wheels
        fi
        ;;
    *)
        echo "MAVBRIDGE_ROS is '${MAVBRIDGE_ROS}', but must be 'wheels' or 'system'." >&2
        return 1
        ;;
    esac
}
