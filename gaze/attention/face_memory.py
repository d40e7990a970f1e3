"""Memory of faces that have left the view, at their last positions.

A camera has a smaller field of view than people, and it turns with the head: some of several people
are always out of its view. The gaze returns to a remembered face when no face is visible. It also
leaves a visible face for it after the end of a turn of talk: if nobody in view continues, a person
out of view may. A remembered face that the gaze does not find is forgotten. So is a face that is
lost under the gaze: idle gaze searches for it (gazerig.gaze.attention.idle).
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from gazerig.gaze.types import Bodies, Vec3, vec

_LASTS_S = 15.0
"""Time for which a face is remembered."""
_FOUND_WITHIN_S = 0.7
"""Time from the change of target: movement of eyes and head, and delay of the camera."""


@dataclass(slots=True)
class _RememberedFace:
    """A face: its last position and time, and the start of the search for it."""

    p_world_m: Vec3
    radius_m: float
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
        self, bodies: Bodies, attended_id: int, captured_s: float, unseen_s: float = -inf
    ) -> Bodies:
        """Return the bodies of a new frame with the remembered faces behind them.

        If a face is visible, these are only faces of people who may have begun to speak out of
        view.

        Args:
            bodies: bodies in the frame.
            attended_id: the present target; -1 for none.
            captured_s: capture time of the frame.
            unseen_s: time before which such a speaker was last visible; -inf without one.
        """
        before, self._captured_s = self._captured_s, captured_s
        seen = frozenset(bodies.ids)
        for id, face in [*self._faces.items()]:
            if id in seen:
                continue
            attended = id == attended_id
            face.sought_s = min(face.sought_s, captured_s) if attended else inf
            lost = attended and face.seen_s == before
            not_found = captured_s - face.sought_s > _FOUND_WITHIN_S
            if lost or not_found or captured_s - face.seen_s > _LASTS_S:
                del self._faces[id]
        for row, kind in enumerate(bodies.kinds):
            if kind == "face":
                p, radius_m = vec(bodies.p_world_m[row]), float(bodies.radius_m[row])
                self._faces[bodies.ids[row]] = _RememberedFace(p, radius_m, captured_s)
        before_s = unseen_s if "face" in bodies.kinds else inf
        rest = {
            id: face
            for id, face in self._faces.items()
            if id not in seen and face.seen_s < before_s
        }
        if not rest:
            return bodies
        still = np.zeros((len(rest), 3))
        faces = rest.values()
        return Bodies(
            (*bodies.ids, *rest),
            (*bodies.kinds, *("face",) * len(rest)),
            np.concatenate((bodies.p_world_m, [face.p_world_m for face in faces])),
            np.concatenate((bodies.v_world_m_s, still)),
            np.concatenate((bodies.w_world_rad_s, still)),
            np.concatenate((bodies.radius_m, [face.radius_m for face in faces])),
        )
