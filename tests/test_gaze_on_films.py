"""People walk in a square, too far off for faces: the gaze is on what moves.

Judged by a mask that knows nothing of flow: what differs from the median of the film's
pictures, and the share within a degree of it.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import radians
from pathlib import Path

import cv2
import numpy as np
import pytest
from fakes.runs import play
from film_gaze import gaze_point, in_picture
from numpy.typing import NDArray

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between
from gazerig.robot.analysis.summary import cyclopean_direction
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick

FILM = Path(__file__).parents[2] / "shared" / "media" / "vtest.avi"
SECONDS, BEGIN_S, RATE_HZ = 18.0, 1.0, 10.0
WIDTH, HEIGHT = 768, 576
SHRINK = 2
DIFFERS = 25  # grey levels
STILL_RAD_S = radians(40.0)  # as an eye tracker finds fixations
GLANCE_S = 0.1


@dataclass
class Fixation:
    """One fixation: seconds, what was looked at, and whether its pictures show motion there."""

    seconds: float
    names: set[str]
    on: list[bool]


CORRECTED_S = 0.25


@pytest.fixture(scope="module")
def ticks(ideal_servos: None) -> tuple[Assembly, list[Tick]]:
    """Run the rig in simulated time; half its rate, and no search for faces of few pixels."""
    if not FILM.exists():
        pytest.skip(f"no film at {FILM}")
    rig = load_rig("desk")
    rig = replace(
        rig,
        loop=replace(rig.loop, rate_hz=100.0),
        detector=replace(rig.detector, min_face_px=60, work_width_px=128),
    )
    made = assemble(rig, RunOptions(mock=True, fast=True, seed=0, video=FILM))
    seen: list[Tick] = []
    # Pictures are large.
    play(made, SECONDS, lambda tick: seen.append(tick._replace(detections=None)))
    return made, seen


@pytest.fixture(scope="module")
def masks() -> list[NDArray[np.uint8]]:
    """Return what moves in each picture."""
    if not FILM.exists():
        pytest.skip(f"no film at {FILM}")
    return moving_masks()


@pytest.fixture(scope="module")
def fixations(ticks: tuple[Assembly, list[Tick]], masks: list[NDArray[np.uint8]]) -> list[Fixation]:
    """Return all fixations but those of the first second, when nothing has been seen to move."""
    made, seen = ticks
    found: dict[int, Fixation] = {}
    for before, tick in pairwise(seen):
        dt_s = tick.t_s - before.t_s
        fast = (
            angle_between(cyclopean_direction(before), cyclopean_direction(tick))
            > STILL_RAD_S * dt_s
        )
        if tick.gaze.phase == "saccade" or fast or tick.t_s < BEGIN_S:
            continue
        fixation = found.setdefault(tick.gaze.fixations, Fixation(0.0, set(), []))
        fixation.seconds += dt_s
        fixation.names.add(f"{tick.target.kind} {tick.target.id}")
        number = int(tick.t_s * RATE_HZ + 1e-6)
        if tick.t_s - number / RATE_HZ < dt_s:  # a picture is taken now
            x, y = (round(c / SHRINK) for c in in_picture(made, gaze_point(tick), WIDTH, HEIGHT))
            mask = masks[number]
            inside = 0 <= x < mask.shape[1] and 0 <= y < mask.shape[0]
            fixation.on.append(inside and bool(mask[y, x]))
    return list(found.values())


def moving_masks() -> list[NDArray[np.uint8]]:
    """Return for each picture, made smaller, what differs from the median of them all."""
    film = cv2.VideoCapture(str(FILM))
    size = WIDTH // SHRINK, HEIGHT // SHRINK
    pictures = []
    for _ in range(int(SECONDS * RATE_HZ) + 1):
        good, picture = film.read()
        assert good and picture.shape == (HEIGHT, WIDTH, 3)
        pictures.append(cv2.resize(picture, size, interpolation=cv2.INTER_AREA))
    film.release()
    ground = np.median(np.stack(pictures[::8]), axis=0).astype(np.uint8)
    speck, degree = np.ones((3, 3), np.uint8), np.ones((11, 11), np.uint8)
    masks = []
    for picture in pictures:
        differs = (cv2.absdiff(picture, ground).max(axis=2) > DIFFERS).astype(np.uint8)
        opened = cv2.morphologyEx(differs, cv2.MORPH_OPEN, speck)
        masks.append(cv2.dilate(opened, degree).astype(np.uint8))
    return masks


def test_the_mask_is_no_easy_target(masks: list[NDArray[np.uint8]]) -> None:
    """Most of the picture is empty, and it does not simply lie where people look at rest."""
    share = np.mean(masks, axis=0)
    assert 0.01 < share.mean() < 0.1
    assert share[HEIGHT // SHRINK // 2, WIDTH // SHRINK // 2] < 0.5


def test_the_gaze_lies_on_what_moves(fixations: list[Fixation]) -> None:
    """A saccade that falls short is corrected after 100 to 200 ms: shorter rests may exist."""
    pictures = [on for fixation in fixations for on in fixation.on]
    assert np.mean(pictures) >= 0.75, f"{sum(pictures)} of {len(pictures)} pictures"
    shown = [fixation for fixation in fixations if fixation.on and fixation.seconds > CORRECTED_S]
    good = [2 * sum(fixation.on) >= len(fixation.on) for fixation in shown]
    assert len(good) >= 10
    assert np.mean(good) >= 0.8, f"{sum(good)} of {len(good)} fixations"


def test_the_gaze_shifts_between_people_as_they_come_and_go(fixations: list[Fixation]) -> None:
    names = {name for fixation in fixations for name in fixation.names}
    assert len([name for name in names if name.startswith("thing")]) >= 6
    lasted = [fixation.seconds for fixation in fixations if fixation.seconds > GLANCE_S]
    assert 0.12 <= np.median(lasted) <= 1.0
    assert max(lasted) < 6.0


def test_nobody_else_is_looked_for_while_people_walk(ticks: tuple[Assembly, list[Tick]]) -> None:
    """No idle glances: from the second picture on something moves."""
    kinds = [tick.target.kind for tick in ticks[1] if tick.t_s >= BEGIN_S]
    assert kinds.count("thing") >= 0.95 * len(kinds)
