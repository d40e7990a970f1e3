"""Startle: a thing that is about to hit the face shuts the lids and draws the head back.

People blink at a virtual collision at a constant time before contact, already as infants (Kayed &
van der Meer 2000), and adults draw the head back from what looms (King, Dykeman, Redgrave & Dean
1992). The time to contact is distance over closing speed, as the growth of the image shows it,
whatever the assumed distance. Camera, lids and neck are late, so the reflex starts some .1 s sooner
than people's. Who walks up or waves is too slow, or passes the face.
"""

from math import inf, sqrt

import numpy as np

from gazerig.gaze.angles import dot, norm, perpendicular, sub, unit
from gazerig.gaze.types import Percept, Vec3, vec

FLINCH = "flinch"
"""Track of lids and head."""
_CONTACT_S = 0.4
"""Time to contact below which it starts."""
_LEAST_M_S = 2.0
"""Speed that startles, if it is faster by a standard deviation of its estimate; people walk at up
to 1.5 m/s.
"""
_PASSES_M = 0.3
"""A thing that passes the face farther away does not hit it."""
_REST_S = 1.0
"""Shortest time between two reflexes."""


class Startle:
    """The reflex of one head, once for each approach."""

    def __init__(self) -> None:
        self._rests_until_s = -inf

    def step(self, percept: Percept | None, p_world_head_m: Vec3, t_s: float) -> bool:
        """Return whether the reflex starts now: something other than a face is about to arrive.

        Args:
            percept: the newest frame.
            p_world_head_m: position of the face.
            t_s: present time.
        """
        if percept is None or t_s < self._rests_until_s:
            return False
        bodies = percept.bodies
        for row, kind in enumerate(bodies.kinds):
            v = vec(bodies.v_world_m_s[row])
            speed_m_s = norm(v)
            if kind == "face" or speed_m_s < _LEAST_M_S or bodies.v_cov is None:
                continue
            ahead, way = unit(v), sub(p_world_head_m, vec(bodies.p_world_m[row]))
            sd_m_s = sqrt(np.array(ahead) @ bodies.v_cov[row] @ np.array(ahead))
            arrives_s = dot(way, ahead) / speed_m_s - percept.age_s(t_s)
            comes = speed_m_s - sd_m_s > _LEAST_M_S and 0.0 < arrives_s < _CONTACT_S
            if comes and norm(perpendicular(way, ahead)) < _PASSES_M:
                self._rests_until_s = t_s + _REST_S
                return True
        return False
