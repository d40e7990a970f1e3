"""Masses of a rig's links: from its file, else from the shapes of the parts.

Only this module combines them. Lengths in metres, tensors about the centre of mass. A centre of
mass in the file is relative to the link's axis, that of the head to the pitch axis of the neck.
"""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from gazerig.gaze.angles import add, scale, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description import mass
from gazerig.robot.description.head_shape import HeadMeasures, field
from gazerig.robot.description.links import ORIGIN, Description, Inertia, Link
from gazerig.robot.description.own_meshes import unknown_links
from gazerig.robot.model.mass_params import MassParams

HEAD = "head"
_MIDDLE: Vec3 = (-0.85, 0.0, 0.10)
"""Centre of the head's solid, in distances between the eyes; servos and frame are around it."""
_OUTSIDE = 0.05
"""Largest distance of a centre of mass from the head's surface, in distances between the eyes."""


def weighed(link: Link, params: MassParams) -> Link:
    """Return a link other than the head, with the mass of its shape or that of the rig's file."""
    inertia, wanted = link.inertia, params.links.get(link.name)
    if wanted is not None:
        shape = inertia or mass.servo()
        kg = shape.mass_kg if wanted.mass_kg is None else wanted.mass_kg
        shape = mass.scale_mass(shape, kg)
        com = shape.com_m if wanted.com_mm is None else scale(wanted.com_mm, 1e-3)
        inertia = Inertia(kg, com, shape.tensor_kg_m2)
    return link._replace(inertia=_with_counterweights(inertia, link.name, params, ORIGIN))


def head_inertia(params: MassParams, measures: HeadMeasures, carried: Sequence[Inertia]) -> Inertia:
    """Return the inertia of the head without the links that it carries, in the head's frame.

    Args:
        params: mass parameters of the rig; the mass of its head includes all carried links.
        measures: dimensions of the head.
        carried: eyes, lids and all other carried links, in the head's frame, without
            counterweights.
    """
    rest = mass.join_inertias(carried)
    kg = _whole_kg(params, measures, rest.mass_kg) - rest.mass_kg
    own = mass.skull(measures.interocular_m)
    middle = measures.scaled(_MIDDLE)
    wanted = params.head
    if wanted.com_mm is None:
        own = mass.filled(own, kg, measures.interocular_m, middle)
    else:
        com = _head_com_m(wanted.com_mm, measures)
        ahead = add(com, scale(sub(com, rest.com_m), rest.mass_kg / kg))
        own = mass.filled(own, kg, measures.interocular_m, middle, ahead)
    with_weights = _with_counterweights(own, HEAD, params, measures.pivot_m)
    assert with_weights is not None
    return with_weights


def mass_faults(
    params: MassParams, measures: HeadMeasures, built: Description
) -> Iterator[tuple[str, str]]:
    """Find masses that are impossible for such a head: key in its file, and the fault.

    Args:
        params: mass parameters of the rig.
        measures: dimensions of the head.
        built: description of the same rig with the masses of its shapes.
    """
    yield from _unknown(params, built)
    bodies = [weighed(link, params).inertia for link in built.links if _is_carried(link, built)]
    rest = mass.join_inertias(body for body in bodies if body is not None)
    wanted, kg = params.head, _whole_kg(params, measures, rest.mass_kg)
    if kg <= rest.mass_kg * 1.01:
        yield (
            "mass.head.mass_kg",
            f"the head weighs {kg:g} kg with all it carries, and eyes, lids and other parts of it "
            f"weigh {rest.mass_kg:.3g} kg already",
        )
        return
    if wanted.com_mm is not None:
        at = np.array([_head_com_m(wanted.com_mm, measures)]) / measures.interocular_m
        if float(field(at)[0]) > _OUTSIDE:
            yield (
                "mass.head.com_mm",
                "this centre of mass is outside the head: give it ahead, left and above of the "
                "neck's pitch axis, in mm",
            )


def _unknown(params: MassParams, built: Description) -> Iterator[tuple[str, str]]:
    for name, fault in unknown_links(built, params.links).items():
        yield f"mass.links.{name}", fault
    if HEAD in params.links:
        yield f"mass.links.{HEAD}", "the head's mass is under mass.head"
    named = {key: one.link for key, one in params.counterweights.items()}
    faults = unknown_links(built, named.values())
    for key, link in named.items():
        if link in faults:
            yield f"mass.counterweights.{key}.link", faults[link]


def _is_carried(link: Link, built: Description) -> bool:
    while link.parent is not None and link.parent != HEAD:
        link = built.link(link.parent)
    return link.parent == HEAD


def _whole_kg(params: MassParams, measures: HeadMeasures, rest_kg: float) -> float:
    made = mass.head_mass_kg(params, measures.interocular_m)
    return made if params.head.mass_kg is not None else max(made, 2.0 * rest_kg)


def _with_counterweights(
    inertia: Inertia | None, link: str, params: MassParams, origin_m: Vec3
) -> Inertia | None:
    parts = [] if inertia is None else [inertia]
    none: Mat3 = mass.diagonal(0.0, 0.0, 0.0)
    for one in params.counterweights.values():
        if one.link == link and one.mass_kg > 0.0:
            at_m = add(scale(one.position_mm, 1e-3), origin_m)
            parts.append(Inertia(one.mass_kg, at_m, none))
    return mass.join_inertias(parts) if len(parts) > 1 else inertia


def _head_com_m(com_mm: Vec3, measures: HeadMeasures) -> Vec3:
    return add(scale(com_mm, 1e-3), measures.pivot_m)


def carried_links(links: Iterable[Link]) -> list[Inertia]:
    """Return the inertias of links that the head carries, in its frame, all joints at 0."""
    at: dict[str, Vec3] = {HEAD: ORIGIN}
    found = []
    for link in links:
        p = at[link.name] = add(at[link.parent or HEAD], link.p_m)
        if link.inertia is not None:
            found.append(link.inertia._replace(com_m=add(p, link.inertia.com_m)))
    return found
