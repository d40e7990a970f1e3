"""People walk in a square, too far off for faces: the gaze is on what moves.

Judged by a mask that knows nothing of flow: what differs from the median of the film's pictures,
and the share within a degree of it. Measured where the film vtest.avi is at hand.
"""

from collections import defaultdict
from dataclasses import replace
from itertools import pairwise
from math import radians
from pathlib import Path

import cv2
import numpy as np
from fakes.runs import play
from film_gaze import gaze_point, in_picture
from msgspec import structs
from numpy.typing import NDArray
from seeing.material import at_hand

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick
from gazerig.robot.control.tick import cyclopean_direction

SECONDS, BEGIN_S, RATE_HZ = 18.0, 1.0, 10.0
WIDTH, HEIGHT = 768, 576
SHRINK = 2
DIFFERS = 25  # grey levels
STILL_RAD_S = radians(40.0)  # as an eye tracker finds fixations
CORRECTED_S = 0.25
"""A saccade that falls short is corrected after 100 to 200 ms: shorter rests may exist."""

WANTED = {
    "gaze on what moves, % of pictures": (75.0, 100.0),
    "fixations on what moves, %": (80.0, 100.0),
    "fixation, median, s": (0.12, 1.0),
    "longest fixation, s": (0.0, 6.0),
    "targets that move, % of ticks": (95.0, 100.0),
    "things looked at": (6.0, 100.0),
}


def measure(full: bool) -> dict[str, float]:
    """Return the figures, none without the film."""
    film = at_hand("vtest.avi")
    if film is None:
        return {}
    rig = load_rig("desk")
    rig = replace(
        rig,
        loop=replace(rig.loop, rate_hz=100.0),
        detector=replace(rig.detector, work_width_px=128),
    )
    made = assemble(rig, RunOptions(mock=True, fast=True, seed=0, video=film, bus="ideal"))
    ticks: list[Tick] = []
    # Pictures are large.
    play(made, SECONDS, lambda tick: ticks.append(structs.replace(tick, detections=None)))
    masks = _moving_masks(film)
    seconds: defaultdict[int, float] = defaultdict(float)
    on: defaultdict[int, list[bool]] = defaultdict(list)
    for before, tick in pairwise(tick for tick in ticks if tick.t_s >= BEGIN_S):
        dt_s = tick.t_s - before.t_s
        turned = angle_between(cyclopean_direction(before), cyclopean_direction(tick))
        if tick.gaze.phase == "saccade" or turned > STILL_RAD_S * dt_s:
            continue
        seconds[tick.gaze.fixations] += dt_s
        number = int(tick.t_s * RATE_HZ + 1e-6)
        if tick.t_s - number / RATE_HZ < dt_s:  # a picture is taken now
            x, y = (round(c / SHRINK) for c in in_picture(made, gaze_point(tick), WIDTH, HEIGHT))
            mask = masks[number]
            inside = 0 <= x < mask.shape[1] and 0 <= y < mask.shape[0]
            on[tick.gaze.fixations].append(inside and bool(mask[y, x]))
    lasting = [2 * sum(on[key]) >= len(on[key]) for key in on if seconds[key] > CORRECTED_S]
    targets = [tick.target for tick in ticks if tick.t_s >= BEGIN_S]
    durations = [length for length in seconds.values() if length > 0.1]
    return {
        "gaze on what moves, % of pictures": 100.0 * float(np.mean(sum(on.values(), []))),
        "fixations on what moves, %": 100.0 * float(np.mean(lasting)),
        "fixation, median, s": float(np.median(durations)),
        "longest fixation, s": max(durations),
        "targets that move, % of ticks": 100.0
        * float(np.mean([target.kind == "thing" for target in targets])),
        "things looked at": len({target.id for target in targets if target.kind == "thing"}),
    }


def _moving_masks(film: Path) -> list[NDArray[np.uint8]]:
    """Return for each picture, made smaller, what differs from the median of them all."""
    capture = cv2.VideoCapture(str(film))
    size = WIDTH // SHRINK, HEIGHT // SHRINK
    pictures = [
        cv2.resize(capture.read()[1], size, interpolation=cv2.INTER_AREA)
        for _ in range(int(SECONDS * RATE_HZ) + 1)
    ]
    capture.release()
    ground = np.median(np.stack(pictures[::8]), axis=0).astype(np.uint8)
    speck, degree = np.ones((3, 3), np.uint8), np.ones((11, 11), np.uint8)
    masks = []
    for picture in pictures:
        differs = (cv2.absdiff(picture, ground).max(axis=2) > DIFFERS).astype(np.uint8)
        opened = cv2.morphologyEx(differs, cv2.MORPH_OPEN, speck)
        masks.append(cv2.dilate(opened, degree).astype(np.uint8))
    return masks
