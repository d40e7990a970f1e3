"""Targets of the head in a film, on one sheet: contact_sheet.py FILM SHEET.png [--seconds 20]

    PYTHONPATH=. python tests/bench/contact_sheet.py film.avi sheet.png

Runs the desk rig on the film in simulated time with emulated servos, and draws frames at equal
intervals with what was found in them (faces in green, what moves in blue), where the measured eyes
looked while the frame was shown (orange), and the target's name. For looking at, not for figures.
"""

import argparse
import sys
from math import ceil
from pathlib import Path

import cv2
import numpy as np

from gazerig.config.schema import load_rig
from gazerig.drivers.types import Detections, ImageArray
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.tick import Tick

sys.path.insert(0, str(Path(__file__).parents[1]))
from fakes.runs import play  # noqa: E402
from film_gaze import gaze_point, in_picture  # noqa: E402

COLUMNS, ROWS = 4, 5
WIDTH_PX = 320
AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
GREEN, BLUE, ORANGE, WHITE = (80, 220, 80), (240, 160, 60), (30, 140, 255), (255, 255, 255)


def main() -> None:
    """Run the film and write the sheet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("film", type=Path)
    parser.add_argument("sheet", type=Path)
    parser.add_argument("--seconds", type=float, default=20.0)
    args = parser.parse_args()
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, video=args.film))
    tiles: list[ImageArray] = []
    every_s = args.seconds / (COLUMNS * ROWS)

    def watch(tick: Tick) -> None:
        found = tick.detections
        due = tick.t_s >= (len(tiles) + 0.5) * every_s
        if due and found is not None and found.image is not None and len(tiles) < COLUMNS * ROWS:
            tiles.append(tile(made, tick, found, found.image))

    play(made, args.seconds, watch)
    cv2.imwrite(str(args.sheet), sheet(tiles))


def tile(made: Assembly, tick: Tick, found: Detections, image: ImageArray) -> ImageArray:
    """Return one frame with what was found, the gaze, and the target's name."""
    shrink = WIDTH_PX / found.width_px
    small = cv2.resize(image, (WIDTH_PX, round(found.height_px * shrink)))
    for face in found.faces:
        for x, y in face.landmarks_px:
            cv2.circle(small, (round(x * shrink), round(y * shrink)), 2, GREEN, -1)
    for blob in found.blobs:
        if blob.centre_px is None:
            continue
        x, y = blob.centre_px
        cv2.circle(small, (round(x * shrink), round(y * shrink)), 5, BLUE, 1)
    x, y = in_picture(made, gaze_point(tick), found.width_px, found.height_px)
    if np.isfinite((x, y)).all():
        cv2.circle(small, (round(x * shrink), round(y * shrink)), 12, ORANGE, 2)
    words = f"{tick.t_s:.1f} s  {tick.target.kind} {tick.target.part or ''}"
    cv2.putText(small, words, (6, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, (0, 0, 0), 3)
    cv2.putText(small, words, (6, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.45, WHITE, 1)
    return np.asarray(small, np.uint8)


def sheet(tiles: list[ImageArray]) -> ImageArray:
    """Return the tiles side by side, row by row."""
    height = tiles[0].shape[0]
    out = np.zeros((ceil(len(tiles) / COLUMNS) * height, COLUMNS * WIDTH_PX, 3), np.uint8)
    for k, one in enumerate(tiles):
        row, column = divmod(k, COLUMNS)
        out[row * height : (row + 1) * height, column * WIDTH_PX : (column + 1) * WIDTH_PX] = one
    return out


if __name__ == "__main__":
    main()
