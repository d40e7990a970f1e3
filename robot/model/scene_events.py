"""Events of an emulated scene that runs are scored by."""

from typing import Literal, Protocol

from gazerig.gaze.types import Vec3


class ExpectedResponse(Protocol):
    """An event of every round of a scene, and the response expected from the gaze.

    response: "look": be on a thing of this kind between start and end; "return": be on it
        again by the end
    start_s, end_s: from the beginning of a round
    place_world_m, within_m: place of that thing: looking at another of its kind elsewhere
        is no answer
    """

    @property
    def name(self) -> str:
        """Return the behaviour that is tested."""
        ...

    @property
    def response(self) -> Literal["look", "return"]:
        """Return how it is judged."""
        ...

    @property
    def kind(self) -> str:
        """Return the kind of thing."""
        ...

    @property
    def start_s(self) -> float:
        """Return its beginning."""
        ...

    @property
    def end_s(self) -> float:
        """Return its end."""
        ...

    @property
    def place_world_m(self) -> Vec3:
        """Return its place."""
        ...

    @property
    def within_m(self) -> float:
        """Return how far around."""
        ...


class BoxingEvent(Protocol):
    """An event of a boxing match; due_s: when the fist of a punch arrives."""

    @property
    def name(self) -> str:
        """Return "punch", "attack" or something else."""
        ...

    @property
    def start_s(self) -> float:
        """Return its beginning."""
        ...

    @property
    def end_s(self) -> float:
        """Return its end."""
        ...

    @property
    def due_s(self) -> float | None:
        """Return by when it must be answered, None: by its end."""
        ...


class SceneEvent(ExpectedResponse, BoxingEvent, Protocol):
    """Both in one."""
