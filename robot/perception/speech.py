"""Detection of speech from the motion of the gap between the lips.

Speech opens and closes the mouth three to six times a second; a smile, a yawn and a mouth that
stays open do not. A person speaks while the gap has recently crossed its own mean several times,
each time by more than the usual error of the mesh.
"""

from dataclasses import dataclass, replace
from typing import Self

# Time constant of the mean; least distance from it that counts; crossings within a window that make
# speech; time without a crossing that ends it.
_MEAN_S, _LEAST_M, _WINDOW_S, _CROSSINGS = 0.6, 0.0012, 1.5, 4


@dataclass(frozen=True, slots=True)
class Speech:
    """Recent motion of a mouth; a value.

    mean_m: running mean of the gap, None before the first; above: the side of it that was last
    crossed to; crossed_s: times of the last crossings; at_s: of the last gap
    """

    mean_m: float | None = None
    above: bool = False
    crossed_s: tuple[float, ...] = ()
    at_s: float = 0.0

    def advance(self, gap_m: float, t_s: float) -> Self:
        """Return the motion after another frame."""
        if self.mean_m is None:
            return replace(self, mean_m=gap_m, at_s=t_s)
        share = min(1.0, max(0.0, t_s - self.at_s) / _MEAN_S)
        off_m = gap_m - self.mean_m
        mean_m = self.mean_m + share * off_m
        if abs(off_m) < _LEAST_M or (off_m > 0.0) is self.above:
            return replace(self, mean_m=mean_m, at_s=t_s)
        crossed = (*self.crossed_s[1 - _CROSSINGS :], t_s)
        return replace(self, mean_m=mean_m, above=not self.above, crossed_s=crossed, at_s=t_s)

    def speaks(self, t_s: float) -> bool:
        """Return whether it moves like the mouth of a speaking person."""
        return len(self.crossed_s) == _CROSSINGS and t_s - self.crossed_s[0] <= _WINDOW_S


NO_SPEECH = Speech()
