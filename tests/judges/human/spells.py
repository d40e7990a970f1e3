"""Spells of a state, and angles between directions, for rows over all of a run's time."""

import numpy as np


def spells(state: np.ndarray) -> list[tuple[int, int]]:
    """Return first tick and first tick after of each time in which a state lasts."""
    edges = np.flatnonzero(np.diff(state.astype(int), prepend=0, append=0))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def apart_deg(a_deg: np.ndarray, b_deg: np.ndarray) -> np.ndarray:
    """Return the angles between directions (..., 2) of yaw and pitch."""
    (yaw_a, pitch_a), (yaw_b, pitch_b) = (np.moveaxis(np.radians(d), -1, 0) for d in (a_deg, b_deg))
    level = np.cos(pitch_a) * np.cos(pitch_b) * np.cos(yaw_a - yaw_b)
    return np.asarray(
        np.degrees(np.arccos(np.clip(np.sin(pitch_a) * np.sin(pitch_b) + level, -1, 1)))
    )
