"""YAML files as they come: unreadable, shipped by name, or any text at all."""

import pytest
from fakes.small_config import Rig, faults_of, one_id_each, write
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from gazerig.config.load import ConfigError, load, read_yaml, shipped_path

GOOD = """\
# a rig
name: nod
joints:
  neck: {id: 1}
  pan:
    id: 2             # ours
    max_speed_deg_s: 500
camera:
  fps: 30
"""


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("# only words\n", "rig.yaml:1: is not a mapping; write 'key: value' lines"),
        ("\n- a\n", "rig.yaml:2: is not a mapping; write 'key: value' lines"),
        (b"a: 1\nb: \xff\n", "rig.yaml:2: is not UTF-8 text; save it as UTF-8"),
        (
            "a: 1\nb:\u00a05\n",
            "rig.yaml:3: not valid YAML: while scanning a simple key from line 2, "
            "could not find expected ':'; column 3 of line 2 is a no-break space",
        ),
        (
            "ä: 1\nb: 2\x07\n",
            "rig.yaml:2: not valid YAML: control characters are not allowed; remove it",
        ),
        (
            "a:\n\tb: 1\n",
            "rig.yaml:2: not valid YAML: while scanning for the next token from line 2, found "
            "character that cannot start any token; "
            "indent with spaces, and put text with %, @ or ` in quotes",
        ),
        (
            "a: 'x\nb: 2\n",
            "rig.yaml:3: not valid YAML: while scanning a quoted scalar from line 1, "
            "found unexpected end of stream; check this line and the one above",
        ),
        (
            "a: 1\n  b: 2\n",
            "rig.yaml:2: not valid YAML: mapping values are not allowed in this context; "
            "check this line and the one above",
        ),
        (
            "a: &a 1\nb: *a\n",
            "rig.yaml:2: not valid YAML: an alias (*) or tag (!), which is not supported; "
            "write the value; check this line and the one above",
        ),
        (
            "a:\n  - !force 1\n",
            "rig.yaml:2: not valid YAML: an alias (*) or tag (!), which is not supported; "
            "write the value; check this line and the one above",
        ),
        (
            "[" * 200,
            "rig.yaml:1: not valid YAML: more than 40 levels or 2000000 values; shorten it; "
            "check this line and the one above",
        ),
    ],
)
def test_a_file_that_cannot_be_used(tmp_path, text, fault):
    assert faults_of(tmp_path, text) == [fault]
    with pytest.raises(ConfigError):
        read_yaml(tmp_path / "rig.yaml")


def test_an_absent_file_is_named_with_a_near_one(tmp_path):
    write(tmp_path, GOOD, "nod.yaml")
    with pytest.raises(ConfigError) as caught:
        load(tmp_path / "nodd.yaml", Rig)
    assert str(caught.value) == (
        f"{tmp_path / 'nodd.yaml'}: No such file or directory; did you mean 'nod.yaml'? "
        "name a YAML file that you may read"
    )


def test_an_unknown_shipped_name_lists_those_that_exist(tmp_path, monkeypatch):
    (tmp_path / "rigs").mkdir()
    for name in ("shake.yaml", "nod.yaml", "notes.txt"):
        write(tmp_path / "rigs", GOOD, name)
    for module in ("load", "shipped_files"):
        monkeypatch.setattr(f"gazerig.config.{module}.SHIPPED", tmp_path)
    assert shipped_path("rigs", "nod") == tmp_path / "rigs" / "nod.yaml"
    with pytest.raises(ConfigError) as caught:
        shipped_path("rigs", "nood")
    assert str(caught.value) == (
        "config/rigs: nothing named 'nood' is shipped; did you mean 'nod'? available: nod, shake"
    )


# ---- anything at all --------------------------------------------------------------------


_pieces = st.sampled_from(
    [*GOOD.splitlines(keepends=True), *"-:?!&*{}[],#|>'\"%@`\n\t ", "*a", "&a ", "<<: ", "!!int "]
    + ["---\n", "...\n", "%YAML 1.1\n---\n", "1_", "0x", "._", "1:30", "\r", "\x00", "\u2028"]
)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.lists(_pieces, max_size=14).map("".join) | st.text(max_size=30))
@example(text='"\\U00110000": 1')
@example(text='"\\UE0000000": 1')
@example(text="a: 1\n%YAML 9.9\n---\n")
@example(text="!!set {a}")
@example(text='"a\\nb\\u2028c": 1')
@example(text="%YAML 1.1\n---\nname: yes\n")
@example(text="joints: {a: {id: 0x" + "f" * 5000 + "}}")
@example(text="baud: " + "9" * 5000)
@example(text="gains: {x: " + "9" * 39 + "}")
def test_junk_text_gives_a_config_error_and_nothing_else(tmp_path, text):
    file = write(tmp_path, text.encode("utf-8", "surrogatepass"))
    try:
        assert isinstance(load(file, Rig, checks=[one_id_each]), Rig)
    except ConfigError as error:
        assert len(str(error).splitlines()) == len(error.faults) > 0
