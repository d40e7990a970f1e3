"""Masses and inertias of the parts of a head, from their shapes and materials.

Lengths in metres, tensors about the centre of mass.
"""

from collections.abc import Iterable, Iterator, Sequence
from math import dist

import numpy as np

from gazerig.gaze.angles import add, scale, sub
from gazerig.gaze.types import Floats, Vec3
from gazerig.robot.description.links import ORIGIN, Description, Inertia, Link, Visual
from gazerig.robot.description.mesh import stored_shell
from gazerig.robot.description.parts import MIDDLE, HeadMeasures
from gazerig.robot.model.weight import MassParams

HEAD_KG, _REFERENCE_M = 0.6, 0.0619
"""Mass of a whole head (skull, servos, eyes, lids) with this distance between the eyes."""
SERVO_KG = 0.023
"""Servo of the size of an XC330 or of models smaller than the STS3215."""
_SERVO_HALF_M: Vec3 = (0.010, 0.013, 0.017)

HEAD = "head"
_FARTHEST = 2.0
"""Largest distance of a centre of mass from the head's middle, in distances between the eyes."""
_CONTENT_HALF: Vec3 = (1.5, 1.1, 0.6)
"""Half axes of a head's contents (servos, frame, counterweight), in distances between the eyes."""


def head_inertia(params: MassParams, measures: HeadMeasures, carried: Sequence[Inertia]) -> Inertia:
    """Return the inertia of the head without the links that it carries, in the head's frame.

    Args:
        params: mass parameters of the rig; the mass of its head includes all carried links.
        measures: dimensions of the head.
        carried: eyes, lids and all other carried links, in the head's frame.
    """
    rest, unit = join_inertias(carried), measures.interocular_m
    whole = params.head.mass_kg
    if whole is None:
        # The shell grows with its surface, the mechanism does not.
        made = HEAD_KG * (0.5 + 0.5 * (unit / _REFERENCE_M) ** 2)
        whole = max(made, 2.0 * rest.mass_kg)
    kg, com = whole - rest.mass_kg, None
    if params.head.com_mm is not None:
        com = _from_pivot(params.head.com_mm, measures)
        com = add(com, scale(sub(com, rest.com_m), rest.mass_kg / kg))
    own = filled(shell("skull", unit), kg, unit, measures.scaled(MIDDLE), com)
    weights = [
        Inertia(one.mass_kg, _from_pivot(one.position_mm, measures), np.zeros((3, 3)))
        for one in params.counterweights.values()
    ]
    return join_inertias((own, *weights)) if weights else own


def mass_faults(
    params: MassParams, measures: HeadMeasures, built: Description
) -> Iterator[tuple[str, str]]:
    """Find masses that are impossible for such a head: key in its file, and the fault.

    Args:
        params: mass parameters of the rig.
        measures: dimensions of the head.
        built: description of the same rig with the masses of its shapes.
    """
    wanted, names = params.head, [link.name for link in built.links]
    rest_kg = sum(one.mass_kg for one in carried_links(built.links[names.index(HEAD) + 1 :]))
    if wanted.mass_kg is not None and wanted.mass_kg <= 1.01 * rest_kg:
        yield (
            "mass.head.mass_kg",
            f"the head weighs {wanted.mass_kg:g} kg with all it carries, and eyes, lids and other "
            f"parts of it weigh {rest_kg:.3g} kg already",
        )
    elif wanted.com_mm is not None:
        away = dist(_from_pivot(wanted.com_mm, measures), measures.scaled(MIDDLE))
        if away > _FARTHEST * measures.interocular_m:
            yield (
                "mass.head.com_mm",
                "this centre of mass is outside the head: give it ahead, left and above of the "
                "neck's pitch axis, in mm",
            )


def carried_links(links: Iterable[Link]) -> list[Inertia]:
    """Return the inertias of links that the head carries, in its frame, all joints at 0."""
    at: dict[str, Vec3] = {HEAD: ORIGIN}
    found = []
    for link in links:
        p = at[link.name] = add(at.get(link.parent or "", ORIGIN), link.p_m)
        if link.inertia is not None:
            found.append(link.inertia._replace(com_m=add(p, link.inertia.com_m)))
    return found


def _from_pivot(position_mm: Vec3, measures: HeadMeasures) -> Vec3:
    return add(scale(position_mm, 1e-3), measures.pivot_m)


def servo(times: float = 1.0) -> Inertia:
    """Return a servo with its bracket, as a box at the centre of its link."""
    mass = times * (SERVO_KG + 0.012)
    x, y, z = (half * half / 3.0 for half in _SERVO_HALF_M)
    return Inertia(mass, (0.0, 0.0, 0.0), np.diag((mass * (y + z), mass * (x + z), mass * (x + y))))


def shell(name: str, unit_m: float) -> Inertia:
    """Return a thin shell of constant thickness in the frame of its shape.

    Args:
        name: name of the shell.
        unit_m: the distance between the eyes, or the radius of a lid or an ear.
    """
    mass, x, y, z, xx, yy, zz, xy, xz, yz = stored_shell(name)
    tensor = np.array(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))) * unit_m**4
    return Inertia(mass * unit_m**2, scale((x, y, z), unit_m), tensor)


def shell_of(look: Visual) -> Inertia:
    """Return the mass of a thin part in the frame of its link."""
    factors = np.broadcast_to(look.scale, 3)
    R = np.array(look.R) * np.sign(factors)
    return in_parent_frame(shell(str(look.shape), abs(float(factors[0]))), R, look.p_m)


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
        tensor = shell.tensor_kg_m2 * (mass_kg / shell.mass_kg)
        return Inertia(mass_kg, shell.com_m if com_m is None else com_m, tensor)
    middle = middle_m
    if com_m is not None:
        moment = mass_kg * np.array(com_m) - shell.mass_kg * np.array(shell.com_m)
        middle = _vector(moment / rest)
    x, y, z = ((half * unit_m) ** 2 / 5.0 for half in _CONTENT_HALF)
    tensor = np.diag((rest * (y + z), rest * (x + z), rest * (x + y)))
    return join_inertias((shell, Inertia(rest, middle, tensor)))


def join_inertias(parts: Iterable[Inertia]) -> Inertia:
    """Join several bodies in the same frame to one."""
    bodies = tuple(parts)
    mass = sum(body.mass_kg for body in bodies)
    com = sum((body.mass_kg * np.array(body.com_m) for body in bodies), np.zeros(3)) / mass
    tensor = np.zeros((3, 3))
    for body in bodies:
        off = np.array(body.com_m) - com  # the parallel-axis theorem
        tensor += body.tensor_kg_m2 + body.mass_kg * ((off @ off) * np.eye(3) - np.outer(off, off))
    return Inertia(mass, _vector(com), tensor)


def in_parent_frame(one: Inertia, R: Floats, p_m: Vec3) -> Inertia:
    """Return the inertia of a body in a parent frame, in which the body's frame has this pose."""
    com = R @ one.com_m + p_m
    return Inertia(one.mass_kg, _vector(com), R @ one.tensor_kg_m2 @ R.T)


def _vector(values: Floats) -> Vec3:
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z
