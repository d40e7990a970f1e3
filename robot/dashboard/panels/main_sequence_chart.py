"""Main sequence of the rig's saccades: peak speed and duration, with the range of people.

The ranges are those of the report (gazerig.robot.analysis.human_norms).
"""

from collections import deque
from collections.abc import Callable, Iterable

import numpy as np

from gazerig.gaze.types import Floats
from gazerig.robot.analysis.human_norms import fastest_peak, longest_ms, shortest_ms, slowest_peak
from gazerig.robot.dashboard.widgets.html import LINE_PX, count_text, heading, line, note, svg, text
from gazerig.robot.model.types import SeenSaccade

KEPT = 400
"""Largest number of saccades shown, the newest ones."""

_LEFT_PX, _RIGHT_PX, _TOP_PX, _FOOT_PX = 38.0, LINE_PX - 10.0, 8.0, 132.0
_WIDEST_DEG = (5.0, 10.0, 20.0, 40.0, 80.0)
_FASTEST_DEG_S = (200.0, 400.0, 600.0, 1000.0)
_LONGEST_MS = (80.0, 160.0, 320.0)
_TICKS = 4
Curve = Callable[[Floats], Floats]


class MainSequenceChart:
    """Chart of the newest saccades."""

    def __init__(self) -> None:
        self._seen: deque[SeenSaccade] = deque(maxlen=KEPT)
        self.count = 0

    def update(self, saccade: SeenSaccade) -> None:
        """Add a saccade."""
        self._seen.append(saccade)
        self.count += 1

    def drawing(self) -> str:
        """Return both charts as HTML."""
        sizes = [s.amplitude_deg for s in self._seen]
        widest = _room(_WIDEST_DEG, sizes)
        speeds = [s.peak_deg_s for s in self._seen]
        lengths = [1e3 * s.duration_s for s in self._seen]
        speed, length = "peak speed, deg/s, against size, deg", "duration, ms, against size, deg"
        fastest, longest = _room(_FASTEST_DEG_S, speeds), _room(_LONGEST_MS, lengths)
        return (
            heading(speed, count_text(self.count, "saccade"))
            + _image(speed, sizes, speeds, widest, fastest, slowest_peak, fastest_peak)
            + heading(length)
            + _image(length, sizes, lengths, widest, longest, shortest_ms, longest_ms)
            + note(
                "grey: people, from Baloh et al. 1975 less 15 % to Bahill et al. 1975 and "
                "Collewijn et al. 1988 and 15 % (speed); 21 ms + 2.2 ms/deg less a quarter to "
                "25 ms + 2.4 ms/deg (Lee, Badler & Badler 2002) and a quarter (duration); "
                "orange: the newest"
            )
        )


def _room(choices: tuple[float, ...], values: list[float]) -> float:
    """Return the smallest end of an axis that includes all values, else the largest."""
    most = max(values, default=0.0)
    return next((choice for choice in choices if choice >= most), choices[-1])


def _image(
    title: str,
    x: list[float],
    y: list[float],
    widest: float,
    highest: float,
    low: Curve,
    high: Curve,
) -> str:
    def at(size: float, value: float) -> tuple[float, float]:
        across = _LEFT_PX + min(1.0, size / widest) * (_RIGHT_PX - _LEFT_PX)
        return across, _FOOT_PX - min(1.0, value / highest) * (_FOOT_PX - _TOP_PX)

    sizes = np.linspace(0.0, widest, 41)
    lower, upper = low(sizes).tolist(), high(sizes).tolist()
    edge = [*zip(sizes.tolist(), lower, strict=True)]
    edge += reversed([*zip(sizes.tolist(), upper, strict=True)])
    band = [at(*point) for point in edge]
    outline = " ".join(f"{u:.1f},{v:.1f}" for u, v in band)
    people = f"<polygon points='{outline}' class='svg-people'/>"
    dots = []
    for i, (a, b) in enumerate(zip(x, y, strict=True)):
        (u, v), is_newest = at(a, b), i == len(x) - 1
        radius, kind = (3.4, "svg-dot newest") if is_newest else (2.0, "svg-dot")
        dots.append(f"<circle cx='{u:.1f}' cy='{v:.1f}' r='{radius}' class='{kind}'/>")
    inside = sum(low(np.array(a)) <= b <= high(np.array(a)) for a, b in zip(x, y, strict=True))
    says = f"{title}: {inside} of {len(x)} saccades inside the human range"
    return svg(_FOOT_PX + 18.0, (people, *_axes(widest, highest), *dots), says)


def _axes(widest: float, highest: float) -> Iterable[str]:
    for i in range(_TICKS + 1):
        share = i / _TICKS
        x = _LEFT_PX + share * (_RIGHT_PX - _LEFT_PX)
        y = _FOOT_PX - share * (_FOOT_PX - _TOP_PX)
        yield line(((_LEFT_PX, y), (_RIGHT_PX, y)), "axis" if i == 0 else "grid")
        yield text(x, _FOOT_PX + 15.0, f"{share * widest:g}", "middle")
        yield text(_LEFT_PX - 4.0, y + 4.5, f"{share * highest:g}", "end")
