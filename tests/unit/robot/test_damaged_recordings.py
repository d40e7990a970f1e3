"""Damaged and hostile recordings: one line each, or the right result; never another."""

import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from fakes.runs import record

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import DriverError
from gazerig.robot.recording.read import RunRecording, report_bad_contents
from gazerig.robot.run.rerun import rerun

# -- damage ----------------------------------------------------------------------------


def flipped(data: bytes, rng: random.Random) -> bytes:
    """Flip 1 to 8 bits anywhere."""
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 8))):
        out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def cut(data: bytes, rng: random.Random) -> bytes:
    """End the file early."""
    return data[: rng.randrange(len(data))]


def overwritten(data: bytes, rng: random.Random) -> bytes:
    """Put zeros, ones or noise over a stretch, as a bad sector does."""
    at, size = rng.randrange(len(data)), rng.choice((1, 16, 512, 4096))
    fill = rng.choice((b"\0" * size, b"\xff" * size, rng.randbytes(size)))
    return data[:at] + fill[: len(data) - at] + data[at + size :]


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    flipped, flipped, cut, overwritten,
)  # fmt: skip


# -- what is made of it ----------------------------------------------------------------


def _exported(file: Path) -> object:
    with report_bad_contents(file):
        return [tick.t_s for tick in RunRecording(file).ticks()]


def _again(file: Path) -> object:
    with report_bad_contents(file):
        done = rerun(RunRecording(file))
    return done.ticks, done.is_same


def _reported(file: Path) -> object:
    pytest.importorskip("gazerig.features.lab")
    from gazerig.features.lab.report.report import read_run

    return len(read_run(RunRecording(file), lambda words, share: None).run.rows)


USES: dict[str, Callable[[Path], object]] = {
    "export": _exported, "rerun": _again, "report": _reported,
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> bytes:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    record(path, load_rig("desk"), 0.3)
    return path.read_bytes()


def test_every_damage_is_refused_or_changes_nothing(run, tmp_path):
    """Right is the whole run, or its beginning if the file is marked as incomplete."""
    file, results = tmp_path / "damaged.mcap", Counter[str]()
    file.write_bytes(run)
    truth = {name: use(file) for name, use in USES.items()}
    assert all(truth.values()), f"nothing to damage: {truth}"
    for number in range(100):
        rng = random.Random(f"1 {number}")
        damage, name = rng.choice(DAMAGES), list(USES)[number % len(USES)]
        file.write_bytes(damage(run, rng))
        what = f"{damage.__name__} {number} {name}"
        try:
            made = USES[name](file)
        except DriverError as error:
            results["refused"] += 1
            assert str(error) and "\n" not in str(error), f"{what}: not one line: {error}"
        else:
            results["right"] += made == truth[name]
            assert made == truth[name] or RunRecording(file).note, f"{what}: another result"
    assert results["refused"] > 50 and results["right"] > 3
