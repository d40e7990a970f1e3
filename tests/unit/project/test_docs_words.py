"""README and docs name commands, options, targets and imports that there are."""

import ast
import importlib
import inspect
import re
import shlex
from types import ModuleType
from typing import Any

from command_line import options, parse
from features_there import needs_all_features
from papers import COMMANDS, EMULATOR, PAPERS, ROOT, Block, blocks, spans

import gazerig
from gazerig.robot.net.client import RobotClient

pytestmark = needs_all_features  # the documents describe every command

STANDS_FOR = {"NAME": "neck_yaw", "FILE": "a.mcap", "KEY": "seed"}
"""What to try where a paper has a word in capitals; 1 for all others."""


def test_a_command_of_a_paper_is_one():
    for words in COMMANDS:
        parse(shlex.split(words))


def test_a_command_named_in_prose_is_one():
    for paper in PAPERS:
        for span in spans(paper):
            if span.startswith("gazerig "):
                words = [_tried(word) for word in span.split()[1:]]
                try:
                    parse(words)
                except ValueError as error:
                    assert "Missing " in str(error), f"{paper.name}: {span}: {error}"


def test_an_option_named_in_prose_is_one():
    of_emulator, of_all = options("emulate"), options()
    for paper in PAPERS:
        known = of_emulator if paper == EMULATOR else of_all
        for span in spans(paper):
            if not span.startswith("--"):
                continue
            for option in re.findall(r"^(--[a-z0-9-]+)|\s(--[a-z0-9-]+)", span):
                assert "".join(option) in known, f"{paper.name}: {span}"


def _tried(word: str) -> str:
    if word in STANDS_FOR:
        return STANDS_FOR[word]
    return "1" if re.fullmatch(r"[A-Z]+", word) else word


def test_make_and_pip_have_what_the_papers_ask_for():
    makefile = (ROOT / "Makefile").read_text()
    made = re.findall(r"^(\w+):", makefile, re.MULTILINE)
    extras = (ROOT / "pyproject.toml").read_text()
    for paper in PAPERS:
        text = paper.read_text()
        for target in re.findall(r"(?:^|`)make (\w+)", text, re.MULTILINE):
            assert target in made, f"{paper.name}: make {target}"
        for package in re.findall(r"pip install --no-deps ([^\s'`]+)", text):
            assert f":= {package}\n" in makefile, f"{paper.name}: {package}"
        for package in re.findall(r"pip install (?!--no-deps)(?:-\w+ )?'?([^\s'`]+)", text):
            found = re.fullmatch(r"(?:\.|gazerig)(?:\[([\w,]+)\])?", package)
            assert found, f"{paper.name}: {package}"
            for extra in found[1].split(",") if found[1] else ():
                assert f"\n{extra} = [" in extras, f"{paper.name}: {package}"


def test_python_of_papers_imports_what_there_is():
    for block in blocks("python"):
        _check_imports(block)


def _check_imports(block: Block) -> None:
    tree = ast.parse(block.text)
    here: dict[str, Any] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            module = importlib.import_module(node.module)
            for part in node.names:
                here[part.name] = _part(module, node.module, part.name)
    for node in ast.walk(tree):
        match node:
            case ast.Attribute(ast.Name(name), attribute) if name in here:
                assert hasattr(here[name], attribute), ast.unparse(node)
            case ast.Call(ast.Attribute(ast.Name("rig"), method), args, keywords):
                call = inspect.signature(getattr(RobotClient, method))
                call.bind(None, *args, **{str(k.arg): k.value for k in keywords})
            case ast.Call(ast.Attribute(ast.Name("head"), method), args, keywords):
                call = inspect.signature(getattr(gazerig.SimulatedHead, method))
                call.bind(None, *args, **{str(k.arg): k.value for k in keywords})
            case ast.Attribute(ast.Name("gazerig"), name):
                assert name in gazerig.__all__


def _part(module: ModuleType, path: str, name: str) -> Any:
    if hasattr(module, name):
        return getattr(module, name)
    return importlib.import_module(f"{path}.{name}")
