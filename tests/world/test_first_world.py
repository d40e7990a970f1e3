"""Choice of ``make run`` if a world can be rendered, and if it cannot."""

import pytest

from gazerig.features.world.gl_context import NoRenderer
from gazerig.features.world.run import first_world
from gazerig.features.world.run.first_world import ROOM, main


class Free:
    def free(self) -> None:
        pass


def test_the_room_where_it_can_be_rendered(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(first_world, "find_spec", lambda name: object())
    monkeypatch.setattr(first_world, "open_context", lambda make: ("egl", Free(), make()))
    main()
    assert capsys.readouterr() == (f"{ROOM}\n", "")


def test_one_line_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(first_world, "find_spec", lambda name: None)
    main()
    out, err = capsys.readouterr()
    assert out == "" and "pip install 'gazerig[world]'" in err and err.count("\n") == 1

    def none(make: object) -> object:
        raise NoRenderer("no pictures of a world: egl: it is missing")

    monkeypatch.setattr(first_world, "find_spec", lambda name: object())
    monkeypatch.setattr(first_world, "open_context", none)
    main()
    out, err = capsys.readouterr()
    assert out == "" and "egl: it is missing" in err and err.count("\n") == 1
