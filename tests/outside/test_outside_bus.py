"""A bus of another package passes the shipped suites, as its author runs them."""

import os
import re
import subprocess
import sys

from outside_bus import EXAMPLE, install_example


def test_it_passes_the_shipped_suites(tmp_path):
    install_example(tmp_path / "site")
    path = os.pathsep.join((str(tmp_path / "site"), *filter(None, sys.path)))
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", os.devnull,
         "--rootdir", str(tmp_path), str(EXAMPLE / "tests")],
        env={**os.environ, "PYTHONPATH": path, "PYTEST_ADDOPTS": "", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-4000:]
    found = re.search(r"(\d+) passed in", done.stdout)
    assert found is not None and int(found[1]) >= 12, done.stdout
    assert "skipped" not in done.stdout and "deselected" not in done.stdout
