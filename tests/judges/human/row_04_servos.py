"""Eyes on the shipped emulated servos: no overshoot, about as fast as commanded.

Single saccades of 5 to 20 deg by the rig's own law, from rest to rest, judged on the true shafts.
Hobby servos get a pulse every 20 ms and follow it with a lag of their own of 30 ms, at their own
speed: they do not overshoot, but their time cannot be that of the command.
"""

from human.eye_steps import EYES, steps
from human.measured_run import Figures, Runs

SIZES_DEG = (5.0, 7.5, 10.0, 15.0, 20.0)

WANTED = {
    "desk, largest overshoot, %": (-10.0, 5.0),
    "desk, longest 10-90 % time over the command's": (0.8, 1.3),
    "desk, fastest over its cap of speed": (0.5, 1.02),
    "feetech, largest overshoot, %": (-10.0, 5.0),
    "feetech, longest 10-90 % time over the command's": (0.8, 1.3),
    "feetech, fastest over its cap of speed": (0.5, 1.02),
    "expressive, largest overshoot, %": (-10.0, 5.0),
    "expressive, longest 10-90 % time over the command's": (0.8, 1.3),
    "maker, largest overshoot, %": (-10.0, 5.0),
}


def measure(runs: Runs) -> Figures:
    """Return the worst of each rig; nothing of it is random."""
    figures: Figures = {}
    for name in EYES:
        every = list(steps(name, SIZES_DEG))
        figures |= {
            f"{name}, largest overshoot, %": 100.0
            * max(one.done_deg.max() / one.size_deg - 1.0 for one in every),
            f"{name}, longest 10-90 % time over the command's": max(
                one.rise_ms(one.done_deg) / one.rise_ms(one.asked_deg) for one in every
            ),
            f"{name}, fastest over its cap of speed": max(
                one.speed_deg_s.max() / one.most_deg_s for one in every
            ),
        }
    return figures
