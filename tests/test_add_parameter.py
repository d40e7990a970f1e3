"""The docs' "Adding a parameter", followed to the letter, on a copy of the package."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]

TRY = """
import json
from gazerig.config.export import json_schema
from gazerig.config.parameters import apply_changes, parameters
from gazerig.config.load import ConfigError
from gazerig.config.schema import Rig, load_rig
from gazerig.gaze.oculomotor.saccade import SaccadeModel

rig, key = load_rig("desk"), "gaze.saccade.rise_share"
(knob,) = [one for one in parameters(rig, rig) if one.key == key]
other = apply_changes(rig, {key: 0.35})
model = SaccadeModel(apply_changes(rig, {"gaze.saccade.profile": "human"}).gaze.saccade)
before = model.displacement_rad(0.1, 0.01)
model.retune(apply_changes(other, {"gaze.saccade.profile": "human"}).gaze.saccade)
try:
    apply_changes(rig, {key: 0.6})
    refused = ""
except ConfigError as error:
    refused = str(error)
schema = json_schema(Rig)["$defs"]["SaccadeParams"]["properties"]["rise_share"]
print(json.dumps({
    "knob": knob._asdict(), "schema": schema, "refused": refused,
    "moved": model.displacement_rad(0.1, 0.01) - before,
}))
"""


def patched(text: str, hunk: str) -> str:
    """Return a text with one hunk of a diff applied; the removed text occurs once."""
    old = "\n".join(line[1:] for line in hunk.splitlines() if line[:1] in " -")
    new = "\n".join(line[1:] for line in hunk.splitlines() if line[:1] in " +")
    assert text.count(old) == 1, old
    return text.replace(old, new)


def test_adding_a_parameter_takes_what_the_paper_says(tmp_path: Path) -> None:
    paper = (ROOT / "docs" / "tuning.md").read_text(encoding="utf-8")
    (diff,) = re.findall(r"```diff\n(.*?)```", paper, re.S)
    head, *hunks = re.split(r"^(?:\+\+\+ .*|@@)\n", diff, flags=re.M)
    name = head.split("a/", 1)[1].strip()
    top = tmp_path / "gazerig"
    top.mkdir()
    for file in (ROOT / "gazerig").iterdir():
        if file.name != "gaze":
            (top / file.name).symlink_to(file)
    shutil.copytree(ROOT / "gaze", top / "gaze")
    text = (top / name).read_text(encoding="utf-8")
    for hunk in hunks:
        text = patched(text, hunk.rstrip("\n"))
    (top / name).write_text(text, encoding="utf-8")
    found = subprocess.run(
        [sys.executable, "-c", TRY],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert found.returncode == 0, found.stderr
    made = json.loads(found.stdout)
    knob = made["knob"]
    assert (knob["low"], knob["high"], knob["default"], knob["unit"]) == (0.2, 0.5, 0.25, "")
    assert knob["live"] == "next tick" and "share of the rise" in knob["description"]
    assert (made["schema"]["minimum"], made["schema"]["maximum"]) == (0.2, 0.5)
    assert "gaze.saccade.rise_share: 0.6 is above 0.5" in made["refused"]
    assert made["moved"] < -1e-4  # a longer rise
