"""Interfaces that are built here where ROS lacks them are the ones of ROS 2."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

# REP 2011: computed from the definitions that ROS ships. Other hashes do not talk to each other.
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

LATER: dict[str, dict[str, str | None]] = {
    "1.4": {
        "nav2_msgs/action/BackUp": (
            "RIHS01_cc8889ed926f2e6956d1a3d0459e8e610289ed689efdcf8bcff3e4a349cea741"
        ),
        "nav2_msgs/action/ComputeAndTrackRoute": (
            "RIHS01_d3970a8643572b8f1398cfb6b4c48dae7db967fb7b809a2b0c2e5b6deed77a2a"
        ),
        "nav2_msgs/action/ComputePathThroughPoses": (
            "RIHS01_938bb3fbebc5dc9fde6be247d2700763eedccfd0f49d3f21fafee418ec9213e9"
        ),
        "nav2_msgs/action/ComputeRoute": (
            "RIHS01_303bfda47f20ae2cb27788d5e8fd0a692f51da499397a3b323ba7f015f8fdedc"
        ),
        "nav2_msgs/action/DriveOnHeading": (
            "RIHS01_14e7a7c5a558249d00ffe1e1ad64c06f4ac85f3527f04811dba9cf0cb0cc38a8"
        ),
        "nav2_msgs/action/FollowGPSWaypoints": (
            "RIHS01_6d6b84ed07e5e547a5133ceacef39aa512c3ce73b1ca80fa4c8252f6bfb09377"
        ),
        "nav2_msgs/action/FollowWaypoints": (
            "RIHS01_667c9e9d426ede27da21dd3cdd3a34e4fc5cc6405b35bc9d5c0b084479920f54"
        ),
        "nav2_msgs/action/NavigateThroughPoses": (
            "RIHS01_79fd41c3d79022e194035040f5adee498dfe56e797ede67e5ca31591d9f52eef"
        ),
        "nav2_msgs/action/Spin": (
            "RIHS01_8463b23d8454c92f735dbc77a62138d4e8570570939e39eab993dd63d8442925"
        ),
        "nav2_msgs/msg/MissedWaypoint": None,
        "nav2_msgs/msg/Route": (
            "RIHS01_e7a30327e3f17e37bb7c8d559ca6a84e189ed17725f0b6ecc02fbcceeef70184"
        ),
        "nav2_msgs/msg/RouteEdge": (
            "RIHS01_d4839a851d45cc763aba226f9fa15a9e3725d7fd91f9f5b05fb0dc796ee45130"
        ),
        "nav2_msgs/msg/RouteNode": (
            "RIHS01_97eae28fcc469a6040bddd9da9d80c3551d4a782b0e6ac690722492735be7e46"
        ),
        "nav2_msgs/msg/WaypointStatus": (
            "RIHS01_4ac489f0a5a77648dcecf79b070c1ce5b126cd8fe4ed6ff0d316f87089b8f028"
        ),
        "nav2_msgs/srv/ClearCostmapAroundPose": None,
    },
    "1.5": {
        "nav2_msgs/action/ComputePathThroughPoses": (
            "RIHS01_40193b04e498d60c45f5a69b95f17bda2223de3bd4dde8269d35ce70fd34b978"
        ),
        "nav2_msgs/action/ComputePathToPose": (
            "RIHS01_27550d8f0473ae91babf72f120bc58c49afbd95c7bcb7795bf4d08d6cc7e89dd"
        ),
        "nav2_msgs/action/FollowObject": (
            "RIHS01_4d6e71c4308e19ff8ab8d1a2f48ff27f8d1e24456280c3d0f716893f76b5494d"
        ),
        "nav2_msgs/action/FollowPath": (
            "RIHS01_7cd53751af929820972f91d44e162fcd3e1d3929bbab089d9f7016ec896b22af"
        ),
        "nav2_msgs/action/NavigateThroughPoses": (
            "RIHS01_75f845da775541d77058e31bc666aff3119100e557a4d9c561b93f06df638bbf"
        ),
        "nav2_msgs/action/NavigateToPose": (
            "RIHS01_8249f00686c6ae22c7854aea17fec2e47bc5fe2390e3513973eb7feb890bbd23"
        ),
        "nav2_msgs/msg/TrackingFeedback": (
            "RIHS01_ef1661da15b2ffba3bc221078786d244a1872141874031aa7f490979f228fddf"
        ),
        "nav2_msgs/srv/ClearCostmapAroundPose": (
            "RIHS01_3b092cbcc5d25708adc0db6f29bc9e5f6cb76c47a774ee097bf05a87f649fa37"
        ),
        "nav2_msgs/srv/ClearCostmapAroundRobot": (
            "RIHS01_44d2b7c7521a1d317d1008344d470413a604cb0f1d162cba80480490b5ce26a4"
        ),
        "nav2_msgs/srv/ClearCostmapExceptRegion": (
            "RIHS01_07ca78b82d39cf741a39c1f5dd1a679f415ccd4ec2ba054751e48a0d633adae8"
        ),
        "nav2_msgs/srv/ClearEntireCostmap": (
            "RIHS01_f6d3228ce896488e63003f99de655e742af27bcab2e75694f4eb8ca1604ccb3d"
        ),
    },
}
"""The types that later forms of nav2_msgs have changed: those of Kilted; of Lyrical and Rolling"""


def forms_of_nav2() -> list[str]:
    """The forms that the installed nav2_msgs contains, found by what it defines."""
    folder = Path(get_package_share_directory("nav2_msgs"))
    marks = {"1.4": "msg/WaypointStatus.json", "1.5": "msg/TrackingFeedback.json"}
    return [form for form, mark in marks.items() if (folder / mark).is_file()]


@pytest.mark.parametrize("name", sorted(HASHES.keys() | LATER["1.4"].keys() | LATER["1.5"].keys()))
def test_a_type_is_that_of_ros(name: str) -> None:
    package, kind, own = name.split("/")
    wanted = HASHES.get(name)
    try:
        folder = get_package_share_directory(package)
        for form in forms_of_nav2():
            wanted = LATER[form].get(name, wanted)
    except PackageNotFoundError:
        if package == "nav2_msgs":
            pytest.skip("nav2_msgs is not built: run make setup-nav2")
        folder = get_package_share_directory(package)
    description = Path(folder, kind, f"{own}.json")
    assert description.is_file() == (wanted is not None)
    if wanted is not None:
        hashes = json.loads(description.read_text("utf-8"))["type_hashes"]
        assert {each["type_name"]: each["hash_string"] for each in hashes}[name] == wanted
