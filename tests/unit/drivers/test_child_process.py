"""Processes of the program's own code: one function starts them."""

import os
import subprocess

import pytest

from gazerig.drivers.process import child_process


def test_a_module_runs_in_a_session_of_its_own_with_what_it_is_given():
    read_fd, write_fd = os.pipe()
    os.write(write_fd, b"x")
    child = child_process.start(
        "pdb", "-c", "p (__import__('os').getsid(0) == __import__('os').getpid(), "
        f"__import__('os').read({read_fd}, 1), __import__('os').environ['EXTRA'], "
        "__import__('os').environ['OPENBLAS_NUM_THREADS'], '' in __import__('sys').path[:1])",
        "-c", "q", os.__file__,
        stdout=subprocess.PIPE, pass_fds=(read_fd,), variables={"EXTRA": "here"},
    )  # fmt: skip
    try:
        said, _ = child.communicate(timeout=60.0)
    finally:
        os.close(read_fd)
        os.close(write_fd)
    assert b"(True, b'x', 'here', '1', False)" in said


def test_run_gives_what_it_wrote_and_ends_what_takes_too_long():
    done = child_process.run("json.tool", b'{"a": 1}', 60.0)
    assert done.returncode == 0 and b'"a": 1' in done.stdout
    with pytest.raises(subprocess.TimeoutExpired):
        child_process.run("timeit", b"", 0.02)
