"""What ``import gazerig`` promises: names and signatures change only on purpose.

After a deliberate change: python tests/unit/gazerig/test_api_surface.py writes
tests/golden/api_surface.txt anew; say so in CHANGELOG.md.
"""

import dataclasses
import inspect
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import users_program

import gazerig

GOLDEN = Path(__file__).parents[3] / "tests" / "golden" / "api_surface.txt"


def surface() -> Iterator[str]:
    """Return one line for each name, attribute and signature."""
    for name in sorted(gazerig.__all__):
        found = getattr(gazerig, name)
        if inspect.isclass(found):
            bases = ", ".join(base.__name__ for base in found.__bases__)
            yield f"class {name}({bases})"
            yield from (f"  {line}" for line in members(found))
        elif inspect.isfunction(found):
            yield f"def {name}{signature(found)}"
        else:
            yield f"{name} = {text(found)}"


def members(kind: type) -> Iterator[str]:
    if dataclasses.is_dataclass(kind):
        yield from (f"{one.name}: {text(one.type)}" for one in dataclasses.fields(kind))
    for name in getattr(kind, "__struct_fields__", ()):
        yield f"{name}: {text(kind.__annotations__[name])}"
    for name, member in sorted(vars(kind).items()):
        if name.startswith("_") and name not in ("__enter__", "__exit__"):
            continue
        if isinstance(member, property):
            assert member.fget is not None
            yield f"{name} -> {signature(member.fget).partition(' -> ')[2]}"
        elif inspect.isfunction(member):
            yield f"def {name}{signature(member)}"


def signature(function: object) -> str:
    assert callable(function)
    return text(str(inspect.signature(function)))


def text(annotation: object) -> str:
    """Return an annotation without the modules that its names are in."""
    words = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    for module in sorted(sys.modules, key=len, reverse=True):
        if module.startswith("gazerig."):
            words = words.replace(f"{module}.", "")
    return words.replace("typing.", "").replace("collections.abc.", "").replace("pathlib.", "")


def test_the_surface_is_as_promised():
    promised = GOLDEN.read_text().splitlines()
    assert list(surface()) == promised


IMPORTED = """
import sys
import gazerig
heavy = [name for name in sys.modules if name.split(".")[0] in ("numpy", "cv2", "pydantic")]
ours = [name for name in sys.modules if name.startswith("gazerig.")]
print(heavy, ours)
"""


def test_the_import_alone_loads_nothing():
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[] []"


@pytest.mark.usefixtures("ideal_servos")
def test_a_program_typed_as_strictly_as_can_be_runs():
    """``make check`` has mypy read it; here it runs."""
    with gazerig.open("desk", fast=True, scene="face-to-face") as head:
        head.step(2.0)
        assert users_program.follow(head, 5.0) == "arrived"


if __name__ == "__main__":
    GOLDEN.write_text("\n".join(surface()) + "\n")
