"""The five buttons under the head: which this rig cannot do, and why."""

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
    """Return the buttons that do nothing on this rig, with the reason for each.

    Args:
        menus: what the rig offers, as it came; empty before it has come.
        joints: the rig's; None before they are known.
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
