"""Lid openings between blinks: lid saccades with vertical gaze, and sleepiness.

Eyes that turn down take both lids down: the upper lid shuts, the lower one opens, by less. So the
middle of the fissure follows the eye, and the fissure narrows (Read 2006: from 9.7 to 6.4 mm at 40
deg down). Nothing here is random.
"""

from gazerig.gaze.lids.lid_params import LidParams
from gazerig.gaze.minimum_jerk import min_jerk

_DROOP_S = 1.0  # duration of a change of the lids with the sleepiness
_GLIDE_S = 0.3  # duration of a change of their rest positions


LidPair = tuple[float, float]
"""A value 0..1 of the upper and one of the lower lids."""

_NOTHING: LidPair = (0.0, 0.0)


def openings(params: LidParams, eye_pitch_deg: float, sleepiness: float) -> LidPair:
    """Return the openings for a vertical gaze, + is up, and a sleepiness of 0..1."""
    share = params.follow_up_share if eye_pitch_deg > 0.0 else 1.0
    upper = _clip(params.rest_opening + params.follow_per_deg * share * eye_pitch_deg)
    lower = _clip(params.lower_rest_opening - params.lower_follow_per_deg * eye_pitch_deg)
    if sleepiness == 0.0:
        return upper, lower
    return (
        _clip(upper * (1.0 - params.sleepy_droop * sleepiness)),
        _clip(lower * (1.0 - params.lower_sleepy_rise * sleepiness)),
    )


def _clip(opening: float) -> float:
    """Return an opening clipped to 0..1."""
    return opening if 0.0 < opening < 1.0 else 1.0 if opening >= 1.0 else 0.0


class LidsAtRest:
    """Openings without blinks and winks as a function of time."""

    def __init__(self, params: LidParams) -> None:
        self._params = params
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Set the initial sleepiness immediately."""
        level = self._params.sleepy_level
        self._droop_from, self._droop_to, self._droop_since_s = level, level, t_s
        self._pitch_deg = 0.0
        self._shown: LidPair | None = None
        self._left = _NOTHING
        self._retuned_s = t_s

    def retune(self, params: LidParams, t_s: float) -> None:
        """Change the parameters without a jump of the openings."""
        before, self._params = self._params, params
        if params.sleepy_level != before.sleepy_level:
            self.set_sleepiness(params.sleepy_level, t_s)
        if self._shown is not None:
            upper, lower = openings(params, self._pitch_deg, self.sleepiness(t_s))
            self._left = self._shown[0] - upper, self._shown[1] - lower
        self._retuned_s = t_s

    def set_sleepiness(self, level: float, t_s: float) -> None:
        """Change the sleepiness within a second: 0 awake .. 1 hardly awake.

        Raises:
            ValueError: level is not within 0..1.
        """
        if not 0.0 <= level <= 1.0:
            raise ValueError(f"sleepy level {level} is not within 0..1")
        self._droop_from = self.sleepiness(t_s)
        self._droop_to, self._droop_since_s = level, t_s

    def sleepiness(self, t_s: float) -> float:
        """Return the present sleepiness of the lids, 0..1."""
        if self._droop_from == self._droop_to:
            return self._droop_from
        way = min_jerk((t_s - self._droop_since_s) / _DROOP_S)
        return self._droop_from + way * (self._droop_to - self._droop_from)

    def step(self, t_s: float, eye_pitch_deg: float) -> LidPair:
        """Return the openings for a vertical gaze."""
        self._pitch_deg = eye_pitch_deg
        wanted = openings(self._params, eye_pitch_deg, self.sleepiness(t_s))
        self._shown = wanted if self._left == _NOTHING else self._glide(wanted, t_s)
        return self._shown

    def _glide(self, wanted: LidPair, t_s: float) -> LidPair:
        """Return openings with the difference that a retune left, which decays in 0.3 s."""
        kept = 1.0 - min_jerk((t_s - self._retuned_s) / _GLIDE_S)
        upper, lower = self._left
        if kept == 0.0:
            self._left = _NOTHING
        return _clip(wanted[0] + kept * upper), _clip(wanted[1] + kept * lower)
