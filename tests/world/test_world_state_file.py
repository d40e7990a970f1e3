"""States of a world between two processes."""

import threading
from pathlib import Path

import numpy as np

from gazerig.features.world.state_file import StateReader, StateWriter


def test_the_newest_state_is_read_and_none_before_the_first(tmp_path: Path) -> None:
    writer = StateWriter(tmp_path / "state", 3)
    reader = StateReader(tmp_path / "state")
    assert reader.newest() is None and reader.begin_s is None
    writer.write(100.0, 0.0, (1.0, 2.0, 3.0))
    writer.write(100.5, 0.5, np.array((4.0, 5.0, 6.0)))
    found = reader.newest()
    assert found is not None
    assert (found.host_s, found.t_s, found.qpos.tolist()) == (100.5, 0.5, [4.0, 5.0, 6.0])
    assert reader.begin_s == 100.0 and reader.count == 2
    assert StateReader(tmp_path / "state").newest() is not None  # who comes later sees it as well


def test_states_are_never_mixed(tmp_path: Path) -> None:
    """A writer that never pauses: every state that is read holds one number throughout."""
    writer = StateWriter(tmp_path / "state", 64)
    reader = StateReader(tmp_path / "state")
    over = threading.Event()

    def write() -> None:
        k = 0.0
        while not over.is_set():
            writer.write(k, k, np.full(64, k))
            k += 1.0

    thread = threading.Thread(target=write)
    thread.start()
    try:
        seen = [found for _ in range(2000) if (found := reader.newest()) is not None]
    finally:
        over.set()
        thread.join()
    assert seen
    assert all(len({one.host_s, one.t_s, *one.qpos.tolist()}) == 1 for one in seen)
