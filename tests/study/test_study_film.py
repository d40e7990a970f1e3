"""Films of conditions: as long as a presentation, of the head, with meaningless names."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from rendering import renders as renders

from gazerig.config.faults import ConfigError
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.film_writer import film_seconds, film_writer
from gazerig.drivers.types import ImageArray
from gazerig.features.study.run import film
from gazerig.features.study.run.study_file import LoadedStudy, load_checked_study, load_study


@pytest.fixture(scope="module")
def study() -> LoadedStudy:
    """The first shipped study, of one second."""
    found = load_study("nakamoto_1")
    trials = replace(found.design.trials, seconds=1.0)
    return replace(found, design=replace(found.design, trials=trials))


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(film, "SIZE_PX", 160)
    monkeypatch.setattr(film, "RATE_HZ", 10.0)
    monkeypatch.setattr(film, "SETTLES_S", 1.0)


def pictures(path: Path) -> list[ImageArray]:
    reader = cv2.VideoCapture(str(path))
    found: list[ImageArray] = []
    while True:
        good, picture = reader.read()
        if not good:
            return found
        found.append(np.asarray(picture, np.uint8))


def of_film(study: LoadedStudy, key: str, **said: str) -> LoadedStudy:
    conditions = dict(study.design.conditions)
    conditions[key] = replace(conditions[key], **said)  # type: ignore[arg-type]
    return replace(study, design=replace(study.design, conditions=conditions))


@pytest.mark.usefixtures("renders")
def test_each_condition_has_a_film_of_the_head_with_a_name_that_says_nothing(
    study: LoadedStudy, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    told: dict[str, list[float]] = {key: [] for key in study.design.conditions}
    made = film.films(study, tmp_path / "films", lambda key: told[key].append)
    assert list(made) == list(study.design.conditions)
    for key, path in made.items():
        assert path.suffix == ".webm" and not any(one in path.name for one in made)
        frames = pictures(path)
        assert len(frames) == 10 and frames[0].shape == (160, 160, 3)
        skin, wall = frames[5][100, 80], frames[5][10, 10]
        assert skin[2] > skin[0] + 20 and wall[0] > wall[2], "a face before a wall"
        assert np.abs(np.diff(np.stack(frames).astype(int), axis=0)).max() > 40, "it moves"
        assert told[key] == sorted(told[key]) and told[key][-1] == 1.0
    assert "".join(capfd.readouterr()) == ""
    before = {key: path.stat().st_mtime_ns for key, path in made.items()}
    again = film.films(study, tmp_path / "films", lambda key: told[key].append)
    assert again == made
    assert {key: path.stat().st_mtime_ns for key, path in again.items()} == before
    film.render(study, "simple", tmp_path / "again.webm", lambda share: None)
    shown, same, other = (
        np.stack(pictures(path)).astype(int)
        for path in (made["simple"], tmp_path / "again.webm", made["face_tracking"])
    )
    assert (shown == same).all() and (shown != other).any()


def test_a_film_of_ones_own_is_taken_as_it_is(study: LoadedStudy, tmp_path: Path) -> None:
    own = of_film(of_film(study, "simple", film="a.webm"), "face_tracking", film="b.webm")
    made = film.films(own, tmp_path, lambda key: lambda share: None)
    assert made == {"simple": Path("a.webm"), "face_tracking": Path("b.webm")}


def test_a_film_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    with (
        pytest.raises(SetupError, match="cannot write VP80 films"),
        film_writer(tmp_path / "no" / "folder.webm", (64, 64), 10.0),
    ):
        pass


def test_a_film_that_is_over_too_soon_is_told_when_the_study_is_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its path counts from the study's folder, wherever the program is started."""
    for name, count in (("a", 30), ("b", 20)):
        with film_writer(tmp_path / f"{name}.webm", (64, 64), 10.0) as write:
            for i in range(count):
                write(np.full((64, 64, 3), 8 * i, np.uint8))
    (tmp_path / "c.webm").write_bytes(b"no film")
    assert film_seconds(tmp_path / "a.webm") == pytest.approx(3.0, abs=0.11)
    text = """\
title: films
conditions:
  a: {film: a.webm}
  b: {film: b.webm}
  c: {film: c.webm}
trials: {seconds: 3}
questionnaires: [nakamoto_tsuruno]
plan: {participants: 6}
"""
    (tmp_path / "s.yaml").write_text(text)
    monkeypatch.chdir("/")
    with pytest.raises(ConfigError) as raised:
        load_checked_study(str(tmp_path / "s.yaml"))
    told = [str(one).removeprefix(f"{tmp_path}/") for one in raised.value.faults]
    assert len(told) == 2
    assert told[0].startswith("s.yaml:4:") and "conditions.b.film: lasts 2.0 s" in told[0]
    assert "conditions.c.film" in told[1] and "cannot be read as a film" in told[1]
