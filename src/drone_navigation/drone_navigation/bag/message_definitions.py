"""ROS message definitions with all dependencies, as a bag stores them.

The texts are those of the installed packages. Their form is that of rosbag2 (encoding
``ros2msg``): the message's own text, then after a line of ``=`` and ``MSG: package/Name`` each
message that is used in it. rosbag2 leaves out the definitions of actions' messages; here they
are made of the action's text, in the same form.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory

ENCODING = "ros2msg"

_SEPARATOR = "=" * 80
_PART = re.compile(r"^---\s*$", re.MULTILINE)
_PARTS = ("_Goal", "_Result", "_Feedback")
_FEEDBACK_MESSAGE = "_FeedbackMessage"
_FIELD = re.compile(r"^\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w")
_INTEGER = (f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))
_PRIMITIVE = {"bool", "byte", "char", "float32", "float64", "string", "wstring", *_INTEGER}


class DefinitionError(RuntimeError):
    """A message definition is not installed; the text names it."""


def type_name(message_type: type) -> str:
    """Return the name of a generated type, such as "geometry_msgs/msg/PoseStamped"."""
    package, kind, *_ = message_type.__module__.split(".")
    return f"{package}/{kind}/{message_type.__name__}"


@cache
def definition(message_type: type) -> str:
    """Return the definition of a message's type, with those of all types that it uses.

    Raises:
        DefinitionError: one of them is not installed.
    """
    package, _, name = type_name(message_type).split("/")
    texts = {f"{package}/{name}": _text(package, name)}
    open_names = [f"{package}/{name}"]
    while open_names:
        used_by = open_names.pop(0)
        for used in _used(texts[used_by], used_by.split("/")[0]):
            if used not in texts:
                texts[used] = _text(*used.split("/"))
                open_names.append(used)
    own, *others = texts
    parts = [f"{_SEPARATOR}\nMSG: {other}\n{texts[other].strip()}\n" for other in others]
    return "\n".join([texts[own].strip() + "\n", *parts])


def _used(text: str, package: str) -> list[str]:
    """Return the messages that a definition of ``package`` has as fields, as "package/Name"."""
    found = [_FIELD.match(line.partition("#")[0]) for line in text.splitlines()]
    types = [field["type"] for field in found if field and field["type"] not in _PRIMITIVE]
    return [kind if "/" in kind else f"{package}/{kind}" for kind in types]


def _text(package: str, name: str) -> str:
    """Return the definition of one message without those that it uses."""
    try:
        share = Path(get_package_share_directory(package))
    except PackageNotFoundError:
        raise DefinitionError(
            f"The package {package} is not installed; source the workspace setup first."
        ) from None
    try:
        if name.endswith(_FEEDBACK_MESSAGE):
            feedback = f"{package}/{name.removesuffix('Message')}"
            return f"unique_identifier_msgs/UUID goal_id\n{feedback} feedback\n"
        for part, ending in enumerate(_PARTS):
            if name.endswith(ending):
                action = share / "action" / f"{name.removesuffix(ending)}.action"
                return _PART.split(action.read_text("utf-8"))[part]
        return (share / "msg" / f"{name}.msg").read_text("utf-8")
    except OSError as error:
        raise DefinitionError(
            f"No definition of {package}/{name} is installed: {error.strerror}."
        ) from error
