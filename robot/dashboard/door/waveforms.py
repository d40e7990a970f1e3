"""Outlines of the sounds of tracks."""

import asyncio
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gazerig.robot.dashboard.door.rig_link import RigLink

BINS = 160


async def waveform(rig: RigLink, track: str) -> Sequence[float]:
    """Return the outline of a track's sound, () without one or if it cannot be read."""
    infos = (await rig.ask({"do": "tracks"})).get("ok", ())
    path = next((info["sound"] for info in infos if info["name"] == track), "")
    return await asyncio.to_thread(_read, path) if path else ()


def _read(path: str) -> Sequence[float]:
    from gazerig.drivers.sound.sound_file import SoundInfo, read_samples

    try:
        return outline(read_samples(SoundInfo(path, 0.0)), BINS)
    except Exception:  # the rig has reported it
        return ()


def outline(samples: NDArray[np.float32], bins: int) -> Sequence[float]:
    """Return the largest magnitude of each part of a sound, as a share of the largest.

    Args:
        samples: (n,) one channel.
        bins: number of equal parts.
    """
    if not len(samples):
        return (0.0,) * bins
    edges = np.linspace(0, len(samples), bins + 1).astype(int)[:-1]
    found = np.maximum.reduceat(np.abs(samples), np.minimum(edges, len(samples) - 1))
    return tuple((found / max(float(found.max()), 1e-9)).round(3).tolist())
