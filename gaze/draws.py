"""Random numbers of the gaze models."""

from math import exp, log, sqrt

import numpy as np


def draw_lognormal(rng: np.random.Generator, mean: float, spread: float) -> float:
    """Draw from the log-normal distribution with a mean, and a standard deviation / mean."""
    sigma2 = log(1.0 + spread**2)
    return mean * exp(sqrt(sigma2) * float(rng.standard_normal()) - 0.5 * sigma2)
