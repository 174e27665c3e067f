"""The page on the command line, held against the commands themselves."""

import re
import shlex
from pathlib import Path

import pytest
from typer.main import get_command

from app.cli.commands import application

PAGE = (Path(__file__).parents[3] / "docs" / "cli.md").read_text(encoding="utf-8")


def options_of(command, name=""):
    """Options of a command and of those below it, by the words that call it."""
    found = {name: {"--help"}}
    for parameter in command.params:
        found[name] |= {*parameter.opts, *parameter.secondary_opts}
    for word, below in getattr(command, "commands", {}).items():
        found |= options_of(below, f"{name} {word}".strip())
    return found


OPTIONS = options_of(get_command(application))
OTHERS = {"--nproc-per-node", "--nthreads", "--nworkers"}
"""Options of torchrun and Dask, which the page names, too."""

EXAMPLES = sorted(
    line
    for block in re.findall(r"^```\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    for line in block.replace("\\\n", " ").splitlines()
    if line.startswith("python main.py")
)


def written_options(text):
    return set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]*", text))


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_has_options_of_its_command(example):
    words = shlex.split(example, comments=True)[2:]
    name = next((n for n in (" ".join(words[:2]), *words[:1]) if n in OPTIONS), "")
    assert written_options(" ".join(words)) <= OPTIONS[name]


def test_every_option_on_the_page_is_one_of_a_command():
    assert written_options(PAGE) - OTHERS <= set().union(*OPTIONS.values())


@pytest.mark.parametrize("name", sorted(OPTIONS))
def test_every_command_and_its_options_are_on_the_page(name):
    assert name in PAGE
    own = {option for option in OPTIONS[name] if option.startswith("--")}
    assert own - {"--help"} <= written_options(PAGE)
