"""Rules for the tests themselves: a process that a test leaves is found and ended."""

import os
import select
import subprocess

import child_processes


def test_a_process_and_what_it_has_started_are_found_and_ended() -> None:
    reads, writes = os.pipe()
    before = child_processes.running()
    process = subprocess.Popen(["sh", "-c", "echo begun; sleep 600 & sleep 500"], stdout=writes)
    os.close(writes)
    assert os.read(reads, 100) == b"begun\n"
    found = child_processes.running().keys() - before.keys()
    assert found == {process.pid}
    child_processes.end(found)
    # The end of the file comes when no process holds the other side.
    assert select.select([reads], [], [], 60.0)[0] and os.read(reads, 100) == b""
    os.close(reads)
    assert child_processes.running().keys() <= before.keys()


def test_a_fork_ends_with_the_one_that_made_it() -> None:
    reads, writes = os.pipe()
    middle = os.fork()
    if middle == 0:
        if os.fork() == 0:
            child_processes.end_with_parent()
            os.write(writes, b"begun\n")
            select.select([], [], [], 600.0)
        else:
            select.select([reads], [], [], 60.0)  # until it has begun
        os._exit(0)
    os.close(writes)
    os.waitpid(middle, 0)
    assert os.read(reads, 100) == b"begun\n"
    assert select.select([reads], [], [], 60.0)[0] and os.read(reads, 100) == b""
    os.close(reads)
