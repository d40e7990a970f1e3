"""Substitutes for a port or a camera have only the parts that the test needs."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:

    class StandIn(Any):
        """Passes for every type."""
else:

    class StandIn:
        """Nothing of its own."""
