"""Looks at a face go to the eyes, to the mouth in speech, and around a spot of each character.

About .40 of the looks at a face are at the eyes (Janik et al. 1978), more at a person who may look
back; speech draws them to the mouth (Buchan et al. 2007). Everyone has a place of their own, from
the brows to the mouth, that stays for months (Peterson & Eckstein 2013; Mehoudar et al. 2014).
"""

from math import atan2, hypot, pi, sin

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import Figures, MeasuredRun, Runs
from human.row_03_rests import SCENE, visits

from gazerig.gaze.types import Vec3
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.sim_mock.scenes.scene import ScenePerson

WANTED = {
    "looks at the eyes, %": (40.0, 60.0),
    "right eye over left": (0.6, 2.0),
    "looks at chin, sides and forehead, %": (5.0, 25.0),
    "looks at the mouth, of a speaker over others": (1.5, 4.0),
    "looks at the eyes of a speaker, %": (25.0, 55.0),
    "bold above shy, mm": (10.0, 50.0),
}


class Talker(EmptyScene):
    """A person who alternately speaks and is silent for 6 s, at one place."""

    name = "talker"
    round_s = 12.0

    def speaks(self, t_s: float) -> bool:
        """Return whether the person speaks."""
        return t_s % self.round_s < 0.5 * self.round_s

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one person."""
        sway = 0.008 * sin(2.0 * pi * 0.17 * t_s)
        face: Vec3 = (0.95, sway, 0.24)
        yaw, pitch = atan2(-face[1], 0.04 - face[0]), atan2(0.13 - face[2], hypot(*face[:2]))
        return (ScenePerson(face, (yaw, pitch), None, self.speaks(t_s)),)


TALKER = Talker()


def measure(runs: Runs) -> Figures:
    """Return the figures over all seeds."""
    parts = np.array([visit.part for one in runs(SCENE) for visit in visits(one)])
    talk = runs(TALKER)
    loud, quiet = (np.concatenate([_looks(one, spoken) for one in talk]) for spoken in (1, 0))
    bold, shy = (
        [_height_mm(one) for one in runs(SCENE, most_s=120.0, character=name)]
        for name in ("bold", "shy")
    )
    eyes = np.isin(parts, ("LE", "RE"))
    return {
        "looks at the eyes, %": 100.0 * eyes.mean(),
        "right eye over left": ((parts == "RE").sum() / max(1, (parts == "LE").sum())),
        "looks at chin, sides and forehead, %": 100.0
        * np.isin(parts, ("DN", "FL", "FR", "UP")).mean(),
        "looks at the mouth, of a speaker over others": (
            (loud == "M").mean() / max(1e-9, (quiet == "M").mean())
        ),
        "looks at the eyes of a speaker, %": 100.0 * np.isin(loud, ("LE", "RE")).mean(),
        "bold above shy, mm": (np.mean(bold) - np.mean(shy)),
    }


def _looks(one: MeasuredRun, spoken: int) -> np.ndarray:
    """Return the parts to which the gaze goes while the person speaks, or does not."""
    begins = np.flatnonzero(np.diff(one.shift) != 0) + 1
    begins = begins[(one.part[begins] != "") & (one.part[begins - 1] != "")]
    phase = one.t_s[begins] % TALKER.round_s
    late = phase % (0.5 * TALKER.round_s) > 2.0  # speech and silence need time to be seen
    return one.part[begins[late & ((phase < 0.5 * TALKER.round_s) == bool(spoken))]]


def _height_mm(one: MeasuredRun) -> float:
    """Return the mean height of the fixated parts above the tip of the nose, by time."""
    on = one.part[one.part != ""]
    return 1e3 * float(np.mean([PARTS_FACE_M[part][2] for part in on]))
