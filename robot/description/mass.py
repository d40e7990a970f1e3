"""Masses and inertias of the parts of a head, from their shapes and materials.

Lengths in metres, tensors about the centre of mass.
"""

from collections.abc import Iterable

import numpy as np

from gazerig.gaze.types import Floats, Mat3, Vec3
from gazerig.robot.description.links import Inertia
from gazerig.robot.model.mass_params import MassParams

_PRINTED_KG_M3 = 1050.0
"""Density of printed PLA or PETG with the usual fraction of air."""
SHELL_M, _GLOBE_M, _LID_M = 1.6e-3, 1.6e-3, 1.2e-3
"""Thickness of the skull's shell, of an eyeball and of a lid."""
HEAD_KG, _REFERENCE_M = 0.6, 0.0619
"""Mass of a whole head (skull, servos, eyes, lids) with this distance between the eyes."""
SERVO_KG = 0.023
"""Servo of the size of an XC330 or of models smaller than the STS3215."""
_SERVO_HALF_M: Vec3 = (0.010, 0.013, 0.017)

_CONTENT_HALF: Vec3 = (1.5, 1.1, 0.6)
"""Half axes of a head's contents (servos, frame, counterweight), in distances between the eyes."""
_SKULL = (47.15, (-0.831, 0.0, 0.110), ((65.81, 0.0, 8.78), (0.0, 72.79, 0.0), (8.78, 0.0, 54.48)))
"""Mass, centre and tensor of a head's shell of that thickness, scaled to eyes 1 m apart."""


def head_mass_kg(params: MassParams, interocular_m: float) -> float:
    """Return the mass of the whole head: from the rig's file, or from its shapes.

    Its shell grows with its surface, its mechanism does not.
    """
    if params.head.mass_kg is not None:
        return params.head.mass_kg
    share = interocular_m / _REFERENCE_M
    return HEAD_KG * (0.5 + 0.5 * share * share)


def servo(times: float = 1.0) -> Inertia:
    """Return a servo with its bracket, as a box at the centre of its link."""
    mass = times * (SERVO_KG + 0.012)
    x, y, z = (half * half / 3.0 for half in _SERVO_HALF_M)
    return Inertia(mass, (0.0, 0.0, 0.0), diagonal(mass * (y + z), mass * (x + z), mass * (x + y)))


def skull(interocular_m: float) -> Inertia:
    """Return the shell of a head, of constant thickness, about the midpoint between the eyes."""
    mass, com, tensor = _SKULL
    unit = interocular_m
    return Inertia(
        mass * unit**2, _vector(np.array(com) * unit), matrix(np.array(tensor) * unit**4)
    )


def globe(radius_m: float) -> Inertia:
    """Return a hollow eyeball about its centre."""
    mass = 4.0 * np.pi * radius_m**2 * _GLOBE_M * _PRINTED_KG_M3
    about = 2.0 / 3.0 * mass * radius_m**2
    return Inertia(mass, (0.0, 0.0, 0.0), diagonal(about, about, about))


def gimbal(radius_m: float) -> Inertia:
    """Return the ring of wire and plastic that carries an eye, about its centre."""
    mass = 0.15 * globe(radius_m).mass_kg
    about = mass * radius_m**2
    return Inertia(mass, (0.0, 0.0, 0.0), diagonal(0.5 * about, 0.5 * about, about))


def sheet(vertices: Floats, faces: np.ndarray, thickness_m: float = _LID_M) -> Inertia:
    """Return a thin plastic sheet, such as a lid or a skull's shell, by its triangles."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    masses = areas * thickness_m * _PRINTED_KG_M3
    # Three points at the midpoints of its edges have the moments of a triangle.
    points = np.concatenate(((a + b) / 2, (b + c) / 2, (c + a) / 2))
    masses = np.tile(masses / 3.0, 3)
    mass = float(masses.sum())
    com = masses @ points / mass
    off = points - com
    second = (off * masses[:, None]).T @ off
    return Inertia(mass, _vector(com), matrix(np.trace(second) * np.eye(3) - second))


def filled(
    shell: Inertia, mass_kg: float, unit_m: float, middle_m: Vec3, com_m: Vec3 | None = None
) -> Inertia:
    """Return a shell with its contents: a homogeneous ellipsoid of servos, frame and ballast.

    Args:
        shell: the skull.
        mass_kg: total mass.
        unit_m: distance between the eyes, which scales the contents.
        middle_m: centre of the contents.
        com_m: total centre of mass, which determines the contents' position; None: middle_m does.
    """
    rest = mass_kg - shell.mass_kg
    if rest <= 0.05 * mass_kg:  # a very large head has a thinner shell
        thinner = scale_mass(shell, mass_kg)
        return thinner if com_m is None else thinner._replace(com_m=com_m)
    middle = middle_m
    if com_m is not None:
        moment = mass_kg * np.array(com_m) - shell.mass_kg * np.array(shell.com_m)
        middle = _vector(moment / rest)
    x, y, z = ((half * unit_m) ** 2 / 5.0 for half in _CONTENT_HALF)
    tensor = diagonal(rest * (y + z), rest * (x + z), rest * (x + y))
    return join_inertias((shell, Inertia(rest, middle, tensor)))


def scale_mass(one: Inertia, mass_kg: float) -> Inertia:
    """Return the same shape with another mass."""
    share = mass_kg / one.mass_kg
    return Inertia(mass_kg, one.com_m, matrix(np.array(one.tensor_kg_m2) * share))


def join_inertias(parts: Iterable[Inertia]) -> Inertia:
    """Join several bodies in the same frame to one."""
    bodies = tuple(parts)
    mass = sum(body.mass_kg for body in bodies)
    com = sum((body.mass_kg * np.array(body.com_m) for body in bodies), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for body in bodies:
        tensor += np.array(body.tensor_kg_m2) + _parallel_axis_tensor(
            np.array(body.com_m) - com, body.mass_kg
        )
    return Inertia(mass, _vector(com), matrix(tensor))


def in_parent_frame(one: Inertia, R: Mat3, p_m: Vec3) -> Inertia:
    """Return the inertia of a body in a parent frame, in which the body's frame has this pose."""
    turn = np.array(R)
    com = turn @ np.array(one.com_m) + p_m
    return Inertia(one.mass_kg, _vector(com), matrix(turn @ np.array(one.tensor_kg_m2) @ turn.T))


def diagonal(x: float, y: float, z: float) -> Mat3:
    """Return a diagonal tensor with these moments."""
    return ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))


def _parallel_axis_tensor(off: Floats, mass_kg: float) -> Floats:
    return np.asarray(mass_kg * ((off @ off) * np.eye(3) - np.outer(off, off)))


def _vector(values: Floats) -> Vec3:
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z


def matrix(values: Floats) -> Mat3:
    """Return a NumPy matrix as rows."""
    a, b, c = np.asarray(values, float)
    return _vector(a), _vector(b), _vector(c)
