"""Animations of the rig's glTF model: rotations of its nodes as joint angles.

The nodes are those that ``gazerig describe`` writes, found by their names. A joint's angle is the
part of its node's rotation about the joint's axis, relative to the rest pose of the description.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.features.animation.animation import (
    SAMPLE_S,
    ImportedAnimation,
    JointMap,
    Series,
    check_count,
    check_keys,
    listed,
)
from gazerig.features.animation.glb import Clip, GltfFile
from gazerig.gaze.types import Floats
from gazerig.robot.description.links import Link
from gazerig.robot.run.rig_description import description_of

_COPY = re.compile(r"(\.\d{3}|_)+$")
"""Endings that Blender adds to names in use, and ``describe`` to names of links."""
_OFF_AXIS_DEG = 1.0


def read(path: Path, data: bytes, rig: Rig, names: JointMap, clip: str) -> ImportedAnimation:
    """Return the animation of a glTF file.

    Args:
        path: path of the file.
        data: its content.
        rig: rig whose description was animated.
        names: joints by the names of nodes.
        clip: name of the animation; "" for all, which must move different nodes.

    Raises:
        SetupError: the file is invalid or has no animation.
    """
    file = GltfFile(path, data)
    links = {link.joint.name: link for link in description_of(rig).links if link.joint}
    series: dict[str, Series] = {}
    notes: list[str] = []
    ignored: dict[str, None] = {}
    for one in _clips(file, clip):
        for channel in one.channels:
            if channel.target.node is None:
                continue
            name = file.item("nodes", channel.target.node).name
            plain = _COPY.sub("", name)
            if plain in links and links[plain].joint.follows:  # type: ignore[union-attr]
                continue
            found = names.find(name) if name in names.given else names.find(plain)
            if channel.target.path != "rotation":
                ignored[f"{name} {channel.target.path}"] = None
            elif found is None:
                ignored[f"{name} rotation (no joint)"] = None
            elif found[0] in series:
                raise SetupError(
                    f"{path}: {name} is animated twice: add --clip NAME with one of: {_listed(file)}"
                )
            else:
                joint, sign = found
                where = f"{path}: {one.name or 'animation'}, {name}"
                times, angles, off_deg = _read_angles(
                    file, where, one, channel.sampler, links[joint]
                )
                series[joint] = times, sign * angles
                if off_deg.max() > _OFF_AXIS_DEG:
                    at_s = times[off_deg.argmax()]
                    notes.append(
                        f"{joint} turns up to {off_deg.max():.1f} deg about other axes (at {at_s:.2f} s), "
                        "which is left out: lock the other axes in the animation program"
                    )
    if ignored:
        notes.append(f"left out: {listed(ignored)}")
    return ImportedAnimation(series, tuple(notes))


def _clips(file: GltfFile, clip: str) -> Sequence[Clip]:
    """Return the animations of a name, or all."""
    clips = file.tree.animations
    if not clips:
        raise SetupError(
            f"{file.path} has no animation: bake constraints to key frames and export with Animation"
        )
    found = [one for one in clips if not clip or one.name == clip]
    if not found:
        raise SetupError(f"{file.path}: no animation {clip!r}; there are: {_listed(file)}")
    return found


def _listed(file: GltfFile) -> str:
    return listed([one.name or "(no name)" for one in file.tree.animations])


def _read_angles(
    file: GltfFile, where: str, clip: Clip, sampler: int, link: Link
) -> tuple[Floats, Floats, Floats]:
    """Return times, angles in degrees, and the rotation about other axes in degrees."""
    if not 0 <= sampler < len(clip.samplers):
        raise SetupError(f"{where}: no sampler {sampler}: export it again")
    found = clip.samplers[sampler]
    spline = found.interpolation == "CUBICSPLINE"
    if not spline and found.interpolation != "LINEAR":
        raise SetupError(
            f"{where}: its interpolation is {found.interpolation!r:.30}, but servos cannot step: use "
            "linear or Bezier keys"
        )
    count = file.item("accessors", found.input).count
    check_count(where, count)
    expected = 3 * count if spline else count
    times, rotations = file.values(found.input)[:, 0], file.values(found.output)
    if rotations.shape != (expected, 4):
        raise SetupError(f"{where}: needs {expected} quaternions: export it again")
    check_keys(where, times, rotations.reshape(count, -1))
    if spline:
        times, rotations = _sample_spline(times, rotations.reshape(count, 3, 4))
    if (np.linalg.norm(rotations, axis=1) < 1e-6).any():
        raise SetupError(f"{where}: a rotation is zero: export it again")
    return times, *joint_angles(link, rotations)


def _sample_spline(times_s: Floats, keys: Floats) -> tuple[Floats, Floats]:
    """Return samples of a cubic spline; keys (n, 3, 4): tangent in, value, tangent out."""
    if len(times_s) == 1:
        return times_s, keys[:, 1]
    even = np.arange(times_s[0], times_s[-1], SAMPLE_S)
    at = np.union1d(even, times_s)
    i = np.clip(np.searchsorted(times_s, at, side="right") - 1, 0, len(times_s) - 2)
    span = (times_s[i + 1] - times_s[i])[:, None]
    s = (at - times_s[i])[:, None] / span
    found = (
        (2.0 * s**3 - 3.0 * s**2 + 1.0) * keys[i, 1]
        + span * (s**3 - 2.0 * s**2 + s) * keys[i, 2]
        + (3.0 * s**2 - 2.0 * s**3) * keys[i + 1, 1]
        + span * (s**3 - s**2) * keys[i + 1, 0]
    )
    return at, found


def joint_angles(link: Link, rotations: Floats) -> tuple[Floats, Floats]:
    """Return a joint's angles in degrees from (n, 4) rotations x, y, z, w of its node.

    Returns:
        The angles about the joint's axis, without jumps, and the remaining rotations.
    """
    assert link.joint is not None
    rest = Rotation.from_matrix(link.R)
    turned = (rest.inv() * Rotation.from_quat(rotations)).as_quat()
    along, w = turned[:, :3] @ np.array(link.joint.axis), turned[:, 3]
    angles = np.unwrap(2.0 * np.arctan2(along, w))
    angles -= 2.0 * np.pi * np.round(angles[0] / (2.0 * np.pi))
    off = 2.0 * np.arccos(np.clip(np.hypot(along, w), 0.0, 1.0))
    return np.degrees(angles), np.degrees(off)
