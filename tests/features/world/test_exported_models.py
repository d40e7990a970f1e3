"""The exported MJCF and URDF have the same, possible masses."""

from typing import Any

import numpy as np
import pytest
from described_rigs import SHIPPED

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.description.export import mjcf, urdf
from gazerig.robot.run.rig_description import description_of

pytestmark = pytest.mark.usefixtures("mujoco")


def exported(rig: Rig) -> Any:
    """Return the MJCF that ``gazerig describe`` writes, compiled."""
    import mujoco

    description = description_of(rig)
    return mujoco.MjModel.from_xml_string(mjcf(description, looks=False).xml)


@pytest.mark.parametrize("name", SHIPPED)
def test_masses_of_a_urdf_are_those_of_the_mjcf_and_possible(mujoco, name):
    """As MuJoCo's importer reads them."""
    rig = load_rig(name)
    text = urdf(description_of(rig), looks=False)
    read, model = mujoco.MjModel.from_xml_string(text.xml, text.assets), exported(rig)
    for i in range(1, model.nbody):
        body = model.body(i)
        if body.mass[0] == 0.0:
            continue
        same = read.body(body.name)
        assert same.mass[0] == pytest.approx(body.mass[0], rel=1e-9)
        assert same.ipos == pytest.approx(body.ipos, abs=1e-9)
        small, middle, large = np.sort(same.inertia)
        assert (small, middle, large) == pytest.approx(np.sort(body.inertia), rel=1e-6, abs=1e-14)
        assert small > 0.0 and small + middle >= large * (1.0 - 1e-9)
