"""Events of an emulated scene, used to score runs."""

from typing import Literal, Protocol

from gazerig.gaze.types import Vec3


class ExpectedResponse(Protocol):
    """An event of every round of a scene, and the response expected from the gaze.

    response: "look": be on a thing of this kind between start and end; "return": be on it
        again by the end
    start_s, end_s: times from the start of a round
    place_world_m, within_m: place of that thing; a look at another one elsewhere is not a response
    """

    @property
    def name(self) -> str:
        """Return the tested behaviour."""

    @property
    def response(self) -> Literal["look", "return"]:
        """Return the kind of response."""

    @property
    def kind(self) -> str:
        """Return the kind of thing."""

    @property
    def start_s(self) -> float:
        """Return the start."""

    @property
    def end_s(self) -> float:
        """Return the end."""

    @property
    def place_world_m(self) -> Vec3:
        """Return the place."""

    @property
    def within_m(self) -> float:
        """Return the radius around the place."""


class BoxingEvent(Protocol):
    """An event of a boxing match; due_s: arrival time of the fist of a punch."""

    @property
    def name(self) -> str:
        """Return "punch", "attack" or another name."""

    @property
    def start_s(self) -> float:
        """Return the start."""

    @property
    def end_s(self) -> float:
        """Return the end."""

    @property
    def due_s(self) -> float | None:
        """Return the time by which a response is due, None: by the end."""
