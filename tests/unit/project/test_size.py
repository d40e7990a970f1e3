"""No folder grows: code tokens, without comments and docstrings; the numbers only go down."""

import re
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[3]
LARGEST = {
    "gaze": 54_170,
    "drivers": 79_370,
    "sim_mock": 35_870,
    "config": 11_540,
    "robot": 117_900,
    "robot/dashboard": 21_780,
    "gazerig": 12_890,
    "doors": 8_500,
    "features/animation": 5_430,
    "features/bringup": 33_830,
    "features/lab": 25_940,
    "features/study": 10_140,
    "features/world": 33_910,
    "tests": 380_000,
}
OPENING, CLOSING = set("([{"), set(")]}")
TOKEN = re.compile(
    r"""(?P<comment>\#[^\n]*)
    |(?P<string>[bfru]{0,2}
        (?:\'{3}(?:[^\\]|\\.)*?\'{3}|"{3}(?:[^\\]|\\.)*?"{3}|'(?:[^\\'\n]|\\.)*'|"(?:[^\\"\n]|\\.)*"))
    |\.?\d(?:e[-+](?=\d)|[\w.])*
    |\w+
    |\*\*=|//=|>>=|<<=|\.\.\.|[-+*/%&|^@=<>!:]=|\*\*|//|<<|>>|->|[^\w\s\\]""",
    re.VERBOSE | re.DOTALL | re.IGNORECASE,
)


def code_tokens(text: str) -> int:
    """Count the tokens of a module, without layout, comments and docstrings.

    By one expression, a fraction of the time of tokenize; a formatted string is one token. A text
    that begins a line outside all brackets is a docstring.
    """
    count = depth = 0
    for token in TOKEN.finditer(text):
        kind, word = token.lastgroup, token[0]
        if kind is None:
            depth += (word in OPENING) - (word in CLOSING)
        elif kind == "comment":
            continue
        elif depth == 0:
            line = text[text.rfind("\n", 0, token.start()) + 1 : token.start()]
            count -= not line.strip()
        count += 1
    return count


def test_no_folder_is_larger_than_it_was():
    sizes: Counter[str] = Counter()
    for top in {folder.partition("/")[0] for folder in LARGEST}:
        for path in (ROOT / top).rglob("*.py"):
            if any(parent.is_symlink() for parent in (path, *path.parents)):
                continue
            name = path.relative_to(ROOT).as_posix()
            folders = [folder for folder in LARGEST if name.startswith(f"{folder}/")]
            if folders:
                sizes[max(folders, key=len)] += code_tokens(path.read_text(encoding="utf-8"))
    faults = [
        f"{folder} has {sizes[folder]:,} code tokens, at most {most:,}: delete something first"
        for folder, most in LARGEST.items()
        if sizes[folder] > most
    ]
    assert not faults, "\n".join(faults)
