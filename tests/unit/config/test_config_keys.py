"""A rig has few keys: each is set by a shipped file, has a paper or an effect that people see."""

import pytest
import yaml

from gazerig.config.load import ConfigError, shipped_path
from gazerig.config.parameters import apply_changes
from gazerig.config.schema import Rig, load_rig
from gazerig.config.shipped_files import SHIPPED
from gazerig.params import Declaration, declarations

MOST_KEYS = 160
MOST_LINES = 300


def leaves(declared, key):
    """Yield every key that holds a value; a star stands for a name that the user chooses."""
    inner = declared.inner
    if declared.params is not None:
        for name, field in declarations(declared.params).items():
            yield from leaves(field, f"{key}.{name}" if key else name)
    elif inner is not None and (declared.form == "mapping" or inner.params is not None):
        yield from leaves(inner, f"{key}.*")
    else:
        yield key


def test_a_rig_has_at_most_so_many_keys():
    keys = list(leaves(Declaration("params", params=Rig), ""))
    assert len(set(keys)) == len(keys) and "buses.*.port" in keys
    assert len(keys) <= MOST_KEYS


def test_a_removed_key_is_answered_with_what_to_do(tmp_path):
    keys = set(leaves(Declaration("params", params=Rig), ""))
    removed = yaml.safe_load((SHIPPED / "removed_keys.yaml").read_text())
    assert keys.isdisjoint(removed) and all(isinstance(text, str) for text in removed.values())
    text = shipped_path("rigs", "minimal").read_text()
    file = tmp_path / "mine.yaml"
    file.write_text(f"camera_recovery: {{give_up_s: 3}}\n{text}")
    with pytest.raises(ConfigError, match=r"mine.yaml:1: camera_recovery\S*: is gone: "):
        load_rig(str(file))
    with pytest.raises(ConfigError, match="joints.neck_yaw.play_deg: is gone: "):
        apply_changes(load_rig("desk"), {"joints.neck_yaw.play_deg": 1.0})


def test_the_desk_rig_is_short():
    text = shipped_path("rigs", "desk").read_text()
    assert len(text.splitlines()) <= MOST_LINES
