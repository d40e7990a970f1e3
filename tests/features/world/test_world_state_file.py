"""States of a world between two processes."""

import threading

import numpy as np

from gazerig.features.world.state_file import StateReader, StateWriter, WorldState


def test_states_are_never_mixed(tmp_path):
    """A writer that never pauses: every state that is read holds one number throughout."""
    writer = StateWriter(tmp_path / "state", 64)
    reader = StateReader(tmp_path / "state")
    over = threading.Event()

    def write() -> None:
        k = 0.0
        while not over.is_set():
            writer.write(WorldState(k, k, np.full(64, k)))
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
