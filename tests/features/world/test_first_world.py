"""Choice of ``make run`` if a world can be rendered, and if it cannot."""

import pytest

from gazerig.drivers.errors import install_command
from gazerig.features.world.gl_context import NoRenderer
from gazerig.features.world.run import first_world
from gazerig.features.world.run.first_world import ROOM, main
from gazerig.robot.cli.computer import ComputerFigures


class Free:
    def free(self) -> None:
        pass


@pytest.fixture(autouse=True)
def quiet(monkeypatch) -> None:
    figures = lambda software: ComputerFigures(2, 0.0, 1.0, software)  # noqa: E731
    monkeypatch.setattr(first_world, "measure", figures)


@pytest.mark.parametrize(
    ("name", "level"), [("llvmpipe (LLVM 15.0.6, 256 bits)", "small"), ("Mesa Intel UHD", "full")]
)
def test_the_room_where_it_can_be_rendered(name, level, monkeypatch, capsys):
    monkeypatch.setattr(first_world, "find_spec", lambda name: object())
    monkeypatch.setattr(first_world, "open_context", lambda make: (Free(), name))
    main()
    assert capsys.readouterr() == (f"--computer {level} {ROOM}\n", "")


def none(make: object) -> object:
    raise NoRenderer("no pictures of a world: egl: it is missing")


@pytest.mark.parametrize(
    ("spec", "why"), [(None, install_command("world")), (object(), "egl: it is missing")]
)
def test_one_line_says_what_is_missing(spec, why, monkeypatch, capsys):
    monkeypatch.setattr(first_world, "load_level", lambda figures: "small")
    monkeypatch.setattr(first_world, "find_spec", lambda name: spec)
    monkeypatch.setattr(first_world, "open_context", none)
    main()
    out, err = capsys.readouterr()
    assert out == "--computer small\n" and why in err and err.count("\n") == 1
