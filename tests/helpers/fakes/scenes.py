"""A scene in which nothing is and nothing happens, to be filled by a test."""

from gazerig.sim_mock.scenes.scene import Event, ScenePerson, Thing


class EmptyScene:
    """A scene; a subclass overrides what it shows."""

    name = "empty"
    round_s = 100.0
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        return ()

    def things(self, t_s: float) -> tuple[Thing, ...]:
        return ()

    def events(self) -> tuple[Event, ...]:
        return ()
