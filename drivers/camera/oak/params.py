"""Parameters of an OAK-D camera."""

from dataclasses import dataclass
from typing import Annotated

from gazerig.params import Bounds


@dataclass(frozen=True)
class OakParams:
    """The camera to use, and its frame rate."""

    # fmt: off
    device: Annotated[str, "device id or IP address, if there are several cameras; empty: the first one found"] = ""
    rate_hz: Annotated[float, Bounds(1, 120), "frame rate"] = 30.0
    # fmt: on
