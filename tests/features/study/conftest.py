"""Short studies with films that are made in an instant, and the command that runs them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shown_page import free_port
from study_helpers import Program

from gazerig.features.lab.film_writer import film_writer
from gazerig.features.study import film
from gazerig.features.study.design import Study, load_study

STUDY = """\
title: Short
conditions:
  alpha: { profile: mitake }
  beta: {}
trials: { seconds: 2, practice: 0 }
questionnaires: [nakamoto_tsuruno]
after: [free_text]
debriefing: [It was the difference.]
hypotheses: [{ measure: nakamoto_tsuruno.naturalness, better: alpha, than: beta }]
participants: 2
"""


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A study of two films of two seconds."""

    def draw(study: Study, key: str, path: Path, progress: object) -> None:
        with film_writer(path, (64, 64), 10.0) as write:
            for _ in range(20):
                write(np.full((64, 64, 3), 100 * (key == "beta"), np.uint8))

    monkeypatch.setattr(film, "_render", draw)
    path = tmp_path / "short.yaml"
    path.write_text(STUDY)
    film.films(load_study(str(path)), tmp_path / "data" / "films", lambda what, share: None)
    return path


@pytest.fixture
def program(tmp_path: Path) -> Any:
    """Starts ``gazerig study run`` at one address; kills it at the end."""
    started: list[Program] = []
    address = f"127.0.0.1:{free_port()}"

    def start(*words: str) -> Program:
        data = ("--data", str(tmp_path / "data"), "--page", address, "--no-browser")
        started.append(Program(*words, "--participant", "1", *data))
        return started[-1]

    yield start
    for one in started:
        one.process.kill()
        one.process.wait()
