"""Lid closure over time in a blink or a wink: fast closing, a hold, slower opening.

Closing is about twice as fast as opening (VanderWerf 2003; Kwon 2013). A closing continues
unchanged to its end whatever changes meanwhile.
"""

from typing import NamedTuple

from gazerig.gaze.minimum_jerk import min_jerk


def closure(since_onset_s: float, close_s: float, hold_s: float, open_s: float) -> float:
    """Return the closure of a lid, 0..1, at a time after the onset of a blink or wink."""
    if since_onset_s <= 0.0 or since_onset_s >= close_s + hold_s + open_s:
        return 0.0
    if since_onset_s < close_s:
        return min_jerk(since_onset_s / close_s)
    if since_onset_s < close_s + hold_s:
        return 1.0
    # Opening starts quickly and ends in a long tail: minimum jerk in a time that runs fast at
    # first.
    s = (since_onset_s - close_s - hold_s) / open_s
    # The polynomial comes out above 1 by a rounding error just before its end.
    return max(0.0, 1.0 - min_jerk(1.0 - (1.0 - s) ** 1.4))


class LidClosure(NamedTuple):
    """One blink or wink.

    onset_s: its start; close_s, hold_s, open_s: its durations at no sleepiness
    lower_share: relative stroke of the lower lid
    depth: relative stroke of both lids, 1 is shut
    slow: factor of these durations
    """

    onset_s: float
    close_s: float
    hold_s: float
    open_s: float
    lower_share: float
    depth: float = 1.0
    slow: float = 1.0

    @property
    def length_s(self) -> float:
        """Return the total duration."""
        return self.slow * (self.close_s + self.hold_s + self.open_s)

    def under_way(self, t_s: float) -> bool:
        """Return whether it is in progress."""
        return self.onset_s <= t_s < self.onset_s + self.length_s

    def at(self, t_s: float) -> float:
        """Return the closure of the upper lid, 0..1; the lower lid's is lower_share of it."""
        since_s = (t_s - self.onset_s) / self.slow
        return self.depth * closure(since_s, self.close_s, self.hold_s, self.open_s)
