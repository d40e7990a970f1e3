"""Test suites that a package runs on its own servo bus or camera, with pytest.

The kinds that gazerig ships pass the same suites. They need the extra ``gazerig[testing]``; the
program itself never imports this package.
"""

import pytest

pytest.register_assert_rewrite("gazerig.testing.bus_suite", "gazerig.testing.camera_suite")

from gazerig.testing.bus_suite import BusBench as BusBench  # noqa: E402
from gazerig.testing.bus_suite import BusSuite as BusSuite  # noqa: E402
from gazerig.testing.bus_suite import BusUnderTest as BusUnderTest  # noqa: E402
from gazerig.testing.camera_suite import CameraBench as CameraBench  # noqa: E402
from gazerig.testing.camera_suite import CameraSuite as CameraSuite  # noqa: E402
