"""Interfaces that are built here where ROS lacks them are the ones of ROS 2 Jazzy."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

# REP 2011: computed from the definitions that Jazzy ships. Other hashes do not talk to each other.
HASHES = {
    "geographic_msgs/msg/GeoPoint": (
        "RIHS01_602c647cf87bbe95a0231b459b5ac30051875d07c0c740b31ad7a8c4662b971e"
    ),
    "geographic_msgs/msg/GeoPose": (
        "RIHS01_8052786d7663e225e38926f7d05716046c931572c25e557d4f70dca55b972626"
    ),
    "geographic_msgs/msg/GeoPoseStamped": (
        "RIHS01_a8e603c050fa992a74283bb462a96fe9d2b151b7a67b14d77250ed7cb4ed96b7"
    ),
    "nav2_msgs/action/AssistedTeleop": (
        "RIHS01_0db8dcd93f8f6072c806b47c8e09f6065e47261d9658db291c359b2a9854f8f4"
    ),
    "nav2_msgs/action/BackUp": (
        "RIHS01_28d3ef6f5c43fdb860f960f4be61825e80d3c6fd54a12af77005eb477ad60d50"
    ),
    "nav2_msgs/action/ComputePathThroughPoses": (
        "RIHS01_bb3cde2342f7eadfe65ed4dff5253edc37e44ae14a3fcee77272d7fef552440c"
    ),
    "nav2_msgs/action/ComputePathToPose": (
        "RIHS01_b11d50c914791956069419b8f4ad441e3c66fcfbd9461f8e87110b77dc6febe9"
    ),
    "nav2_msgs/action/DockRobot": (
        "RIHS01_d4398769495d327a0cba210e3cf1055ac742ec8a3eccc683f88b1c730b1d6405"
    ),
    "nav2_msgs/action/DriveOnHeading": (
        "RIHS01_9eca8a3505f973b994ac18f4aaf76c0c4563cc7cde1ce7384be2f70e53479c11"
    ),
    "nav2_msgs/action/FollowGPSWaypoints": (
        "RIHS01_deb1908eea298a935abb60a75fbd334549be5ed3c9767ba14729c414fb5881d2"
    ),
    "nav2_msgs/action/FollowPath": (
        "RIHS01_9d95513552fb578cfb933d7e0160273911269cbdf4b348f1acb87d8a903b13cf"
    ),
    "nav2_msgs/action/FollowWaypoints": (
        "RIHS01_09e36a19e0374ab692e78b877e3345daa223ca4186b8af90f77939b78c6e6d7b"
    ),
    "nav2_msgs/action/NavigateThroughPoses": (
        "RIHS01_4e680a34fd27772095da6ffdb32ae348adbc3d948248d38cf8d5ca3fc7a3a6c4"
    ),
    "nav2_msgs/action/NavigateToPose": (
        "RIHS01_a56dba8a3234a1215e610180dc703ae25bbf406dded8b54887891c9732857eab"
    ),
    "nav2_msgs/action/SmoothPath": (
        "RIHS01_84ea77c54dbe197a3d45c188124cf4535b1a1f3f0ffd2f86b841a1d63f1c2cda"
    ),
    "nav2_msgs/action/Spin": (
        "RIHS01_9fc4653cfb2982465e9ca4e2710f0532de8f6dce77d6a6eada55e4e22273b55c"
    ),
    "nav2_msgs/action/UndockRobot": (
        "RIHS01_fe446bf5f84bbdc08b5a1123365e3c9b1e522e50a412d64c36995f808df915a2"
    ),
    "nav2_msgs/msg/Costmap": (
        "RIHS01_d51bf7aecafdbb3f8f98215de648abe6d53f8db69156d6e143125d2ad2bf0027"
    ),
    "nav2_msgs/msg/CostmapMetaData": (
        "RIHS01_1a41ec8428d50c3b4cd3f9055e1adb0eaec72fb39ae11686b59218f6e0884cbd"
    ),
    "nav2_msgs/msg/MissedWaypoint": (
        "RIHS01_cc79d1e3a1b86cd6a80788b16c844c396932462560936293011f062c21b82ed1"
    ),
    "nav2_msgs/srv/ClearCostmapAroundPose": (
        "RIHS01_cd006590d0a7b5a357138518c1ac6f733782a0317f5d8fc92f46158e5438138c"
    ),
    "nav2_msgs/srv/ClearCostmapAroundRobot": (
        "RIHS01_24973b6e8b3e7ec70c37d6b411f1e32cef44051dfe7f34ad0ee7d6d9055cd6ea"
    ),
    "nav2_msgs/srv/ClearCostmapExceptRegion": (
        "RIHS01_66032323269ef923ab356273a7b7fc1c5acd9ccd46cd14bdcd265642a4012b05"
    ),
    "nav2_msgs/srv/ClearEntireCostmap": (
        "RIHS01_553f54f9cadab44553fdf5627433fcb6701f71c1fc2eb55a7b4a004fdeeab952"
    ),
    "nav2_msgs/srv/GetCostmap": (
        "RIHS01_1c3d7c36488ea60fb6ddf76482faf36cee004e29433fea60b8cee011fcd8ad73"
    ),
    "nav2_msgs/srv/LoadMap": (
        "RIHS01_eb875de5ea9bb394573effc3f239015b19869dd7a8988136768372c6ef907ec1"
    ),
    "nav2_msgs/srv/ManageLifecycleNodes": (
        "RIHS01_1850f4f677251bb8f7744e3c0a87ef4f66c205e2f8740a8330251af7d1804460"
    ),
    "tf2_msgs/msg/TFMessage": (
        "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
    ),
}


@pytest.mark.parametrize("name", HASHES)
def test_a_type_is_that_of_jazzy(name: str) -> None:
    package, kind, own = name.split("/")
    try:
        folder = get_package_share_directory(package)
    except PackageNotFoundError:
        assert package == "nav2_msgs", f"{package} is a part of the workspace"
        pytest.skip("nav2_msgs is not built: run make setup-nav2")
    description = Path(folder, kind, f"{own}.json")
    hashes = json.loads(description.read_text("utf-8"))["type_hashes"]
    assert {each["type_name"]: each["hash_string"] for each in hashes}[name] == HASHES[name]
