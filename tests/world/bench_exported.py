"""Exported models against running worlds: python tests/world/bench_exported.py

Prints a Markdown table and draws docs/figures/exported_models.png. Nothing here passes or fails.
"""

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from exported_bench import Both, moves

PICTURE = Path(__file__).parents[2] / "docs" / "figures" / "exported_models.png"
SHOWN = (
    ("desk", "left_eye_pan", "profile"), ("desk", "left_eye_pan", "jump"),
    ("desk", "neck_pitch", "jump"), ("feetech", "neck_pitch", "profile"),
    ("maker", "eyes_pan", "jump"), ("desk", "neck_pitch", "fall"),
)  # fmt: skip


def main() -> None:
    """Measure, print and draw."""
    print(
        "| rig, joint | move | largest difference, deg | % of the move | peak speed, deg/s |",
        end="",
    )
    print(" stall, Nm |\n|--|--|--|--|--|--|")
    figure, axes = plt.subplots(2, 3, figsize=(11, 6))
    for move in moves():
        both = Both(move)
        world, plain = both.world, both.plain
        row = f"| {move.rig} {move.joint} | {move.kind} |"
        if move.kind == "stall":
            torques = (abs(world.torque_nm[-1]), abs(plain.torque_nm[-1]))
            print(row, f"| | | {torques[0]:.3f} / {torques[1]:.3f} |", flush=True)
            continue
        off = float(np.abs(world.angle_deg - plain.angle_deg).max())
        share = 100.0 * off / abs(world.angle_deg[-1] - world.angle_deg[0])
        peaks = [np.abs(one.speed_deg_s).max() for one in (world, plain)]
        print(row, f"{off:.2f} | {share:.1f} | {peaks[0]:.0f} / {peaks[1]:.0f} | |", flush=True)
        key = (move.rig, move.joint, move.kind)
        if key in SHOWN:
            at = axes.flat[SHOWN.index(key)]
            at.plot(world.angle_deg, label="running world", lw=2.5, color="#b8c4d6")
            at.plot(plain.angle_deg, "--", label="exported MJCF alone", lw=1.2, color="#a03020")
            at.set_title(f"{move.rig}, {move.joint}, {move.kind}", fontsize=9)
            at.set_xlabel("ms", fontsize=8)
            at.set_ylabel("deg", fontsize=8)
    axes.flat[0].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=90)
    print(f"written: {PICTURE}", file=sys.stderr)


if __name__ == "__main__":
    main()
