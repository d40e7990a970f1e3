"""Memory of faces that have left the view, at their last positions.

A camera has a smaller field of view than people, and it turns with the head: some of several people
are always out of its view. They share the gaze with the visible ones. A remembered face that the
gaze does not find is forgotten. So is the last visible face if it is lost under the gaze: idle gaze
searches for it (gazerig.gaze.attention.idle).
"""

from collections.abc import Collection
from dataclasses import dataclass
from math import dist, inf

from gazerig.gaze.types import BodyRows, Vec3

_STILL: Vec3 = (0.0, 0.0, 0.0)
_LASTS_S = 60.0
"""Time for which a face is remembered."""
_SAME_M = 0.2
_FOUND_WITHIN_S = 1.0
"""Time from the change of target: movement of eyes and head, and delay of the camera."""


@dataclass(slots=True)
class _RememberedFace:
    """A face: its last position and time, and the start of the search for it."""

    p_world_m: Vec3
    seen_s: float
    sought_s: float = inf


class FaceMemory:
    """Memory of faces that were seen recently."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all faces."""
        self._faces: dict[int, _RememberedFace] = {}
        self._captured_s = -inf

    def step(
        self,
        rows: BodyRows,
        attended_id: int,
        captured_s: float,
        lifeless: Collection[int] = (),
    ) -> BodyRows:
        """Return the bodies of a new frame with the remembered faces behind them.

        Args:
            rows: bodies in the frame.
            attended_id: the present target; -1 for none.
            captured_s: capture time of the frame.
            lifeless: ids of faces that are not remembered.
        """
        before, self._captured_s = self._captured_s, captured_s
        alone = "face" not in rows.kinds
        for id, face in [*self._faces.items()]:
            if id in rows.ids:
                continue
            attended = id == attended_id
            face.sought_s = min(face.sought_s, captured_s) if attended else inf
            lost = attended and alone and face.seen_s == before
            not_found = captured_s - face.sought_s > _FOUND_WITHIN_S
            another = any(dist(face.p_world_m, p) < _SAME_M for p in rows.p_world_m)
            if lost or another or not_found or captured_s - face.seen_s > _LASTS_S:
                del self._faces[id]
        for id in lifeless:
            self._faces.pop(id, None)
        for id, kind, p in zip(rows.ids, rows.kinds, rows.p_world_m, strict=True):
            if kind == "face" and id not in lifeless:
                self._faces[id] = _RememberedFace(p, captured_s)
        rest = {id: face.p_world_m for id, face in self._faces.items() if id not in rows.ids}
        still = [_STILL] * len(rest)
        return BodyRows(
            (*rows.ids, *rest),
            (*rows.kinds, *["face"] * len(rest)),
            [*rows.p_world_m, *rest.values()],
            rows.v_world_m_s + still,
            rows.w_world_rad_s + still,
        )
