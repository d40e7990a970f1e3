"""Five buttons under the head: reasons why a rig cannot do some of them."""

from collections.abc import Mapping, Sequence

GESTURES = ("nod", "shake", "surprised", "sleepy")
WINK = "wink"
_WITH_LIDS = ("surprised", "sleepy")
_NO_LIDS = "this rig has no lids"
_NOT_NOW = "not while a calibration is under way"
_NO_JOINTS = "this rig has none of the joints that it moves"


def refused_moves(
    menus: Mapping[str, Sequence[str]], joints: Sequence[str] | None
) -> dict[str, str]:
    """Return button -> reason of the buttons that this rig cannot do.

    Args:
        menus: Menus of the rig; empty before they are received.
        joints: Names of the rig's joints; None before they are known.
    """
    if not menus:
        return {}
    if "gesture" not in menus:
        return dict.fromkeys((*GESTURES, WINK), _NOT_NOW)
    no_lids = joints is not None and not any("lid" in joint for joint in joints)
    refused = {
        name: _NO_LIDS if no_lids and name in _WITH_LIDS else _NO_JOINTS
        for name in GESTURES
        if name not in menus["gesture"]
    }
    return {**refused, WINK: _NO_LIDS} if no_lids else refused
