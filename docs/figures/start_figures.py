"""Draw the pictures of docs/start.md: mechanisms with their ids, wiring, and what to measure.

What stands in them is the program's: joints and ids from gazerig.robot.cli.new, whose file a
reader writes with ``gazerig new``.
"""

from collections.abc import Sequence
from math import radians, sin
from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  # the backend must be chosen before
from matplotlib.axes import Axes  # noqa: E402
from matplotlib.patches import Arc, Circle, Ellipse, FancyBboxPatch, Rectangle, Wedge  # noqa: E402

from gazerig.config.schema import load_rig  # noqa: E402
from gazerig.robot.cli.new import MECHANISMS  # noqa: E402
from gazerig.robot.description.links import EYE_RADIUS  # noqa: E402

HERE = Path(__file__).parent
INK, SOFT, EYE, SKIN = "#2c3136", "#9aa3a9", "#1c6ea4", "#f3e3d3"
SERVO, POWER, GROUND, DATA = "#d9660a", "#b3261e", "#2c3136", "#1c6ea4"
EYE_AT = {"left": 1.0, "right": -1.0}
"""A head that looks at the reader has its left eye on the right of the picture."""


def main() -> None:
    """Draw all pictures into docs/figures."""
    for draw in (mechanisms, wiring, measures, drawing):
        draw()
        print(f"docs/figures/start_{draw.__name__}.png")


def mechanisms() -> None:
    """Each mechanism of ``gazerig new`` from the front: what each servo turns, and its number."""
    figure, axes = plt.subplots(2, 2, figsize=(10, 8.6))
    for one, (name, mechanism) in zip(axes.flat, MECHANISMS.items(), strict=True):
        _canvas(one, (-3.4, 3.4), (-3.3, 2.5))
        one.set_title(f"--joints {name}\n{mechanism.summary}", fontsize=10, color=INK)
        _face(one, mechanism.joints)
        for number, joint in enumerate(mechanism.joints):
            _numbered(one, joint, number)
    _saved("mechanisms", figure)


def wiring() -> None:
    """The three ways from computer to servos: what is plugged where, and what number counts."""
    figure, axes = plt.subplots(3, 1, figsize=(10, 9.4))
    for one in axes:
        _canvas(one, (0, 12), (0, 4.2))
    _bus(axes[0])
    _board(
        axes[1], "Hobby servos on a Pololu Maestro (--board maestro)", "Maestro", "USB",
        "/dev/ttyACM0", "servo supply into the board's own power terminal, never from USB",
    )  # fmt: skip
    _board(
        axes[2], "Hobby servos on a PCA9685 (--board pca9685)", "PCA9685", "SDA, SCL,\nGND, 3.3 V",
        "/dev/i2c-1", "servo supply into V+ and GND; VCC is the computer's 3.3 V",
    )  # fmt: skip
    _saved("wiring", figure)


def measures() -> None:
    """What a rig's file wants to know of a head: lengths, and which way angles count."""
    figure, (side, front) = plt.subplots(1, 2, figsize=(10, 5.2))
    _canvas(side, (-2.4, 4.6), (-2.4, 4.4))
    side.set_title("from its right side (the head looks to the right)", fontsize=10, color=INK)
    side.add_patch(Ellipse((0.6, 1.9), 3.2, 3.9, fc=SKIN, ec=SOFT))
    side.plot([-1.6, 1.6], [-1.6, -1.6], color=INK, lw=3)
    side.plot([0, 0], [-1.6, 0], color=SOFT, lw=6, solid_capstyle="round")
    _axis(side, (0, 0), "pitch axis of the neck")
    side.add_patch(Circle((1.6, 2.0), 0.42, fc="white", ec=EYE, lw=2))
    side.add_patch(Circle((1.95, 2.0), 0.14, color=EYE))
    side.add_patch(FancyBboxPatch((1.75, 3.15), 0.5, 0.3, boxstyle="round,pad=0.05", fc=INK))
    side.text(2.5, 3.3, "camera: position_mm\nahead, left, above of\nbetween the eyes", fontsize=8, va="center", color=INK)  # fmt: skip
    _length(side, (-1.9, -1.6), (-1.9, 0), "pitch_axis_\nheight_mm")
    _length(side, (-1.9, 0), (-1.9, 2.0), "eyes_\nabove_mm")
    _length(side, (0, -0.55), (1.6, -0.55), "eyes_ahead_mm", below=True)
    for start, end in (((-1.9, 0), (0, 0)), ((-1.9, 2.0), (1.6, 2.0)), ((1.6, 2.0), (1.6, -0.55))):
        side.plot(*zip(start, end, strict=True), color=SOFT, lw=0.8, ls=":")
    side.add_patch(Arc((0, 0), 6.6, 6.6, theta1=18, theta2=48, color=SERVO, lw=1.6))
    side.annotate("", (2.0, 2.62), (2.2, 2.45), arrowprops={"arrowstyle": "->", "color": SERVO})
    side.text(3.15, 1.35, "pitch + is up,\na lid's + is open", fontsize=8, color=SERVO)
    _canvas(front, (-3.3, 3.3), (-2.4, 4.4))
    front.set_title("from the front: its left is on your right", fontsize=10, color=INK)
    front.add_patch(Ellipse((0, 1.9), 3.9, 4.4, fc=SKIN, ec=SOFT))
    for x in EYE_AT.values():
        front.add_patch(Circle((x * 0.85, 2.0), 0.45, fc="white", ec=EYE, lw=2))
        front.add_patch(Circle((x * 0.85, 2.0), 0.17, color=EYE))
    _length(front, (-0.85, 3.0), (0.85, 3.0), "interocular_mm")
    for x in EYE_AT.values():
        front.plot([x * 0.85] * 2, [2.0, 3.0], color=SOFT, lw=0.8, ls=":")
    front.annotate("", (2.6, -1.0), (-2.6, -1.0), arrowprops={"arrowstyle": "->", "color": SERVO, "lw": 1.6})  # fmt: skip
    front.text(0, -1.45, "yaw and pan: + is to the head's own left", ha="center", fontsize=8, color=SERVO)  # fmt: skip
    front.text(0, -2.0, "roll: + is its right ear down", ha="center", fontsize=8, color=SERVO)
    _saved("measures", figure)


HORN_MM, MG90S_MM, DEG_PER_US = 12.0, (22.8, 12.2, 28.5), 0.09
"""Length of a servo's horn, size of an MG90S without its ears, and its turn for a pulse."""


def arm_mm(points: Sequence[Sequence[float]]) -> float:
    """Return the length of a joint's arm whose push rod, parallel to the horn, gives these points.

    The rod moves both ends by the same length: horn x sin(servo) = arm x sin(joint).
    """
    (low_deg, low_us), (high_deg, high_us) = points[0], points[-1]
    servo = radians(abs(high_us - low_us) * DEG_PER_US / 2.0)
    return HORN_MM * sin(servo) / sin(radians((high_deg - low_deg) / 2.0))


def drawing() -> None:
    """The head of the rig maker to build, in mm: what its file has, and the arms of its rods."""
    rig = load_rig("maker")
    eyes, up = rig.geometry.interocular_mm, rig.geometry.eyes_above_mm
    ball = EYE_RADIUS * eyes
    ahead, _, lens = rig.camera.position_mm
    figure, (front, side) = plt.subplots(1, 2, figsize=(10, 6.2))
    for one, title in (
        (front, "from the front"),
        (side, "from its right side"),
    ):
        _canvas(one, (-98, 98), (-50, 160))
        one.set_title(f"{title}, mm", fontsize=10, color=INK)
        one.plot([-70, 70], [0, 0], color=INK, lw=3)
    for x in (-eyes / 2, eyes / 2):
        front.add_patch(Circle((x, up), ball, fc="white", ec=EYE, lw=2))
        front.add_patch(Circle((x, up), 0.45 * ball, fc="none", ec=EYE))
        front.plot([x, x], [up - ball - 8, up + ball + 8], color=SOFT, lw=0.8, ls="-.")
        front.plot([x, x], [up, up + 36], color=SOFT, lw=0.8, ls=":")
    front.plot([-70, 70], [up, up], color=SOFT, lw=0.8, ls="-.")
    front.text(71, up, "tilt axis, and\nof all lids", fontsize=8, va="center", color=INK)
    _length(front, (-eyes / 2, up + 33), (eyes / 2, up + 33), f"{eyes:g}")
    _length(front, (eyes / 2 - ball, up - 30), (eyes / 2 + ball, up - 30), f"eyeball {2 * ball:.1f}", below=True)  # fmt: skip
    _length(front, (-62, 0), (-62, up), f"{up:g} ")
    front.text(-eyes / 2, up - ball - 12, "pan axis", fontsize=8, ha="center", va="top", color=INK)
    side.add_patch(Circle((0, up), ball, fc="white", ec=EYE, lw=2))
    side.add_patch(
        Arc((0, up), 2 * ball + 6, 2 * ball + 6, theta1=10, theta2=95, color=SERVO, lw=3)
    )
    side.add_patch(
        Arc((0, up), 2 * ball + 6, 2 * ball + 6, theta1=265, theta2=350, color=SERVO, lw=3)
    )
    side.text(27, up + 20, "upper lid, about the\neye's centre", fontsize=8, color=SERVO)
    side.text(20, up - 32, "lower lid", fontsize=8, color=SERVO)
    _axis(side, (0, up), "")
    width, depth, height = MG90S_MM
    arm = arm_mm(rig.joints["eyes_tilt"].transmission_points)
    shaft = (-56.0, up + arm - HORN_MM)
    corner = (shaft[0] - width / 2, shaft[1] - height)
    side.add_patch(Rectangle(corner, width, height, fc=SKIN, ec=SERVO))
    size = f"MG90S\n{width:g} x {depth:g} x {height:g}"
    side.text(shaft[0], corner[1] - 3, size, fontsize=8, ha="center", va="top", color=SERVO)
    side.plot([shaft[0], shaft[0]], [shaft[1], shaft[1] + HORN_MM], color=SERVO, lw=4)
    side.plot([0, 0], [up, up + arm], color=EYE, lw=4)
    side.plot([shaft[0], 0], [up + arm] * 2, color=INK, lw=1.4)
    side.text(-44, up + arm + 4, "push rod of eyes_tilt", fontsize=8, ha="center", color=INK)
    side.text(shaft[0] - 3, shaft[1] + 4, f"horn {HORN_MM:g}", fontsize=8, ha="right", color=SERVO)
    side.text(-3, up + 4, f"arm {arm:.1f}", fontsize=8, ha="right", color=EYE)
    side.add_patch(Circle((ahead, lens), 4, fc=INK))
    side.text(ahead + 7, lens, "camera's lens", fontsize=8, va="center", color=INK)
    _length(side, (-84, 0), (-84, lens), f"{lens:g} ")
    _length(side, (0, lens + 10), (ahead, lens + 10), f"{ahead:g}")
    for number, (name, joint) in enumerate(rig.joints.items()):
        text = f"{name}: {joint.min_deg:g} to {joint.max_deg:+g} deg, arm {arm_mm(joint.transmission_points):.1f} for a horn of {HORN_MM:g}"
        (front if number < 3 else side).text(
            -85, -18 - 13 * (number % 3), text, fontsize=8, color=INK
        )
    _saved("drawing", figure)


def _face(axes: Axes, joints: Sequence[str]) -> None:
    """Draw what a mechanism moves: eyes, lids that are there, and a neck."""
    if "neck_yaw" in joints:
        axes.add_patch(FancyBboxPatch((-0.5, -3.1), 1.0, 1.6, boxstyle="round,pad=0.1", fc=SKIN, ec=SOFT))  # fmt: skip
        axes.add_patch(Ellipse((0, 0.1), 5.0, 4.3, fc=SKIN, ec=SOFT))
    for side, x in EYE_AT.items():
        axes.add_patch(Circle((x, 0.3), 0.62, fc="white", ec=EYE, lw=1.6))
        axes.add_patch(Circle((x, 0.3), 0.24, color=EYE))
        for edge, angles in (("upper", (35, 145)), ("lower", (215, 325))):
            if f"{side}_{edge}_lid" in joints:
                axes.add_patch(Wedge((x, 0.3), 0.72, *angles, width=0.24, fc=SERVO, alpha=0.35))
    if "eyes_pan" in joints:
        axes.plot([-1, 1], [-0.62, -0.62], color=SOFT, lw=4, solid_capstyle="round", zorder=0)
        for x in EYE_AT.values():
            axes.plot([x, x], [-0.62, 0.0], color=SOFT, lw=3, zorder=0)


_LABEL_AT = {
    "eyes_pan": (-1.1, -1.6), "eyes_tilt": (1.1, -1.6),
    "left_eye_pan": (2.6, -0.6), "left_eye_tilt": (2.6, 0.35),
    "right_eye_pan": (-2.6, -0.6), "right_eye_tilt": (-2.6, 0.35),
    "left_upper_lid": (1.5, 1.75), "right_upper_lid": (-1.5, 1.75),
    "left_lower_lid": (2.3, -0.75), "right_lower_lid": (-2.3, -0.75),
    "neck_yaw": (0, -2.95), "neck_pitch": (1.9, -2.45), "neck_roll": (-1.9, -2.45),
}  # fmt: skip
_ARROW_AT = {
    "eyes_pan": (0.0, -0.65), "eyes_tilt": (1.0, -0.2),
    **{f"{side}_eye_{way}": (x, 0.3 - 0.3 * (way == "pan")) for side, x in EYE_AT.items() for way in ("pan", "tilt")},
    **{f"{side}_upper_lid": (x, 0.98) for side, x in EYE_AT.items()},
    **{f"{side}_lower_lid": (x, -0.38) for side, x in EYE_AT.items()},
    "neck_yaw": (0, -2.3), "neck_pitch": (0.4, -1.9), "neck_roll": (-0.4, -1.9),
}  # fmt: skip


def _numbered(axes: Axes, joint: str, number: int) -> None:
    """Write a joint's name with its number: the id counts from 1, a board's channel from 0."""
    axes.annotate(
        f"{joint}\nid {number + 1} · channel {number}", _ARROW_AT[joint], _LABEL_AT[joint],
        ha="center", va="center", fontsize=7.5, color=INK,
        bbox={"boxstyle": "round,pad=0.3", "fc": "white", "ec": SERVO, "lw": 1},
        arrowprops={"arrowstyle": "-", "color": SERVO, "lw": 0.9},
    )  # fmt: skip


def _bus(axes: Axes) -> None:
    """Draw servos on one line, power beside it."""
    axes.set_title("Dynamixel or Feetech servos on one line (--board dynamixel, feetech)", fontsize=10, color=INK)  # fmt: skip
    _box(axes, 0.2, 2.6, "computer")
    _box(axes, 3.0, 2.6, "adaptor\n(U2D2, ...)")
    axes.plot([1.9, 3.0], [3.05, 3.05], color=DATA, lw=2)
    axes.text(2.45, 3.2, "USB", ha="center", fontsize=8, color=DATA)
    for i in range(4):
        x = 5.8 + 1.55 * i
        _box(axes, x, 2.6, f"servo\nid {i + 1 if i < 3 else '...'}", wide=1.1, edge=SERVO)
        axes.plot([x - 0.45 if i else 4.7, x], [3.05, 3.05], color=DATA, lw=2)
        axes.plot([x + 0.35] * 2, [2.6, 1.25], color=POWER, lw=1.6)
        axes.plot([x + 0.75] * 2, [2.6, 0.65], color=GROUND, lw=1.6)
    axes.text(5.2, 3.2, "data", ha="center", fontsize=8, color=DATA)
    axes.plot([3.85, 3.85], [2.6, 0.65], color=GROUND, lw=1.6)
    _supply(axes, "5 V (XL330) or as your servo's data sheet says", 11.2)
    port = "port: /dev/ttyUSB0 or /dev/ttyACM0"
    ids = "every servo has its own id: gazerig setup gives them one by one"
    axes.text(0.2, 3.85, f"{port} · {ids}", fontsize=8, color=INK)


def _board(axes: Axes, title: str, name: str, link: str, port: str, power: str) -> None:
    """Draw hobby servos on a board's channels."""
    axes.set_title(title, fontsize=10, color=INK)
    _box(axes, 0.2, 2.6, "computer")
    _box(axes, 3.4, 2.3, name, high=1.3)
    axes.plot([1.9, 3.4], [3.05, 3.05], color=DATA, lw=2)
    axes.text(2.65, 3.13, link, ha="center", fontsize=7, color=DATA)
    for i in range(4):
        x = 6.4 + 1.4 * i
        _box(axes, x, 2.6, f"servo\nch. {i if i < 3 else '...'}", wide=1.05, edge=SERVO)
        rail = 3.61 + 0.08 * i  # ordered so that no line crosses another
        along = [5.1, 5.68 - 0.06 * i, x + 0.5, x + 0.5]
        axes.plot(along, [2.55 + 0.3 * i, rail, rail, 3.5], color=SERVO, lw=1)
    axes.plot([4.0, 4.0], [2.3, 1.25], color=POWER, lw=1.6)
    axes.plot([4.5, 4.5], [2.3, 0.65], color=GROUND, lw=1.6)
    _supply(axes, power, 5.2)
    axes.text(0.2, 3.85, f"port: {port} · a joint's id is its channel, from 0", fontsize=8, color=INK)  # fmt: skip


def _supply(axes: Axes, text: str, end: float) -> None:
    """Draw the servos' own supply with its switch and fuse."""
    _box(axes, 0.2, 0.5, "servo\nsupply", edge=POWER)
    axes.plot([1.9, end], [1.25, 1.25], color=POWER, lw=1.6)
    axes.plot([1.9, end], [0.65, 0.65], color=GROUND, lw=1.6)
    axes.text(2.0, 1.33, "switch, fuse", fontsize=7, color=POWER)
    axes.text(2.0, 0.36, "ground: one for supply, servos and adaptor", fontsize=7, color=GROUND)
    axes.text(0.2, 0.02, text, fontsize=8, color=POWER)


def _box(
    axes: Axes, x: float, y: float, text: str, wide: float = 1.7, high: float = 0.9, edge: str = INK
) -> None:
    axes.add_patch(FancyBboxPatch((x, y), wide, high, boxstyle="round,pad=0.02", fc="white", ec=edge, lw=1.4))  # fmt: skip
    axes.text(x + wide / 2, y + high / 2, text, ha="center", va="center", fontsize=8.5, color=INK)


def _axis(axes: Axes, at: tuple[float, float], text: str) -> None:
    axes.add_patch(Circle(at, 0.14, fc="white", ec=INK, lw=1.6, zorder=4))
    axes.plot(*at, ".", color=INK, zorder=5)
    axes.text(at[0] + 0.25, at[1] + 0.08, text, fontsize=8, color=INK)


def _length(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str, below: bool = False
) -> None:
    """Draw a measured length with the key that it stands under."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": "<->", "color": EYE, "lw": 1.4})
    x, y = (start[0] + end[0]) / 2, (start[1] + end[1]) / 2
    if start[0] == end[0]:
        axes.text(x - 0.1, y, text, ha="right", va="center", fontsize=8, color=EYE)
    else:
        axes.text(x, y - 0.15 if below else y + 0.1, text, ha="center", va="top" if below else "bottom", fontsize=8, color=EYE)  # fmt: skip


def _canvas(axes: Axes, x: tuple[float, float], y: tuple[float, float]) -> None:
    axes.set_xlim(*x)
    axes.set_ylim(*y)
    axes.set_aspect("equal")
    axes.axis("off")


def _saved(name: str, figure: plt.Figure) -> None:
    HERE.mkdir(exist_ok=True)
    figure.tight_layout()
    figure.savefig(HERE / f"start_{name}.png", dpi=110, facecolor="white")
    plt.close(figure)


if __name__ == "__main__":
    main()
