"""Whether all features are there: what is said of the whole program is not tested without one."""

from functools import cache
from importlib.util import find_spec

import pytest

from gazerig.drivers.plugins import SHIPPED


@cache
def removed_features() -> tuple[str, ...]:
    """Return the packages of features that register parts and are not there."""
    modules = {value.partition(":")[0] for parts in SHIPPED.values() for value in parts.values()}
    features = {".".join(name.split(".")[:3]) for name in modules if ".features." in name}
    return tuple(sorted(name for name in features if find_spec(name) is None))


def need_every_feature() -> None:
    """Skip the test if a feature was removed."""
    if removed := removed_features():
        pytest.skip(f"removed: {', '.join(removed)}")
