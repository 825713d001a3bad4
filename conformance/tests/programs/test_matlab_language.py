# SPDX-License-Identifier: MIT
"""The MATLAB programs are MATLAB, and not Octave alone: tokens, names, and the commands that MATLAB is given."""

import re
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from miss_hit_core.errors import Message_Handler
from miss_hit_core.m_language import MATLAB_Latest_Language
from miss_hit_core.m_lexer import MATLAB_Lexer

from conformance.programs.ports import ROOT, read_ports

MATLAB = """
    addpath all arrayfun catch close cos delete desktop dir disp error exit fclose figure find fopen fprintf gcf grid
    isempty isfile isfinite isfolder isscalar legend mat2str movefile nargout numel ode45 odeset plot print reshape sin
    size sprintf strjoin struct title usejava ver version warning xlabel ylabel yline
"""  # functions of its documentation, in R2019a or before
SIMULINK = """
    add_block add_line bdIsLoaded close_system get_param new_system open_system save_system set_param sim
"""
FUNCTIONS = {*MATLAB.split(), *SIMULINK.split()}
PROGRAMS = [path.name for path in sorted(ROOT.glob("matlab/*.m"))]
COMMANDS = {
    f"{port.name}: {' '.join(kind)}": words[-1]
    for port in read_ports().values()
    for engine in port.engines
    for kind, words in ((("version",), engine.version), (("command",), engine.command), (("present",), engine.present))
    if engine.program == "matlab" and words
}


def problems(text: str) -> list[str]:
    """What a lexer for MATLAB finds in a text that MATLAB would not run, or would run as something else."""
    handler = Message_Handler("debug")
    handler.register_file("text")
    lexer = MATLAB_Lexer(MATLAB_Latest_Language(), handler, text, "text")
    tokens = [*iter(lexer.token, None)]
    known = FUNCTIONS | declared(text)
    found = [f"line {t.location.line}: a command or operator of Octave: {t.raw_text}" for t in tokens if foreign(t)]
    for before, token in pairwise([None, *tokens]):
        place = f"line {token.location.line}"
        if token.kind == "IDENTIFIER" and not (before and before.kind == "SELECTION") and token.raw_text not in known:
            found.append(f"{place}: unknown name {token.raw_text}")
        if (
            before
            and (before.kind, token.kind) == ("KET", "BRA")
            and before.location.col_end + 1 == token.location.col_start
        ):
            found.append(f"{place}: the result of a call is indexed")
    return found


def foreign(token: object) -> bool:
    """Whether a token is text that is no string: a command's argument, or what begins with an exclamation mark."""
    return token.kind == "BANG" or (token.kind == "CARRAY" and token.raw_text[0] not in "'\"")


def declared(text: str) -> set[str]:
    """The names that a text assigns, or declares as functions and their arguments."""
    targets = re.findall(r"(?:^|;|\s)(\w+)(?:\.\w+)?\s*=(?!=)", text)
    lists = re.findall(r"\[([\w, ~]+)\]\s*=(?!=)", text)
    functions = re.findall(r"^\s*function\s+(.*)$", text, flags=re.MULTILINE)
    caught = re.findall(r"\b(?:catch|for)\s+(\w+)", text)
    return {*targets, *caught, *re.findall(r"\w+", " ".join([*lists, *functions]))}


def block_code(text: str) -> str:
    """The code that a program hands to a block as quoted lines."""
    lines = re.findall(r"^ {4}'(.*)'$", text, flags=re.MULTILINE)
    return "\n".join(line.replace("''", "'") for line in lines)


@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_use_what_matlab_has(name: str) -> None:
    assert problems((ROOT / "matlab" / name).read_text()) == []


def test_code_of_the_block_is_what_a_block_has() -> None:
    text = (ROOT / "matlab/Chapter17_Lesson1_Simulink.m").read_text()
    code = block_code(text)
    assert "u = alpha1DotKnown" in code
    given = ["t", "x1", "x2", "thetaHat", "thetaTrue", "k1", "k2", "gamma", "amplitude", "omega"]
    assert problems("\n".join([*(f"{name} = 0;" for name in given), code, ""])) == []


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_for_matlab_are_matlab(name: str, tmp_path: Path) -> None:
    code = COMMANDS[name].replace("; ", ";\n")
    programs = f"{Path(PROGRAMS[0]).stem} = 0; {Path(PROGRAMS[1]).stem} = 0;"
    assert problems(f"{programs}\n{code}") == []
    (tmp_path / "command.m").write_text(code + "\n")
    answer = subprocess.run(
        [sys.executable, "-m", "miss_hit.mh_lint", "--brief", tmp_path], capture_output=True, text=True
    )
    assert answer.returncode == 0, answer.stdout


def test_there_are_commands_for_matlab() -> None:
    assert len(COMMANDS) == 5


@pytest.mark.parametrize(
    "fragment",
    [
        "x = 0; printf('%d', x);", "fputs(1, 'x');", "x = 0; x += 1;", "x = 0; y = x != 1;", "x = 0; y = size(x)(1);",
        "do\nuntil x", "unwind_protect\nend_unwind_protect", "x = 1;\nif x\nendif", "!ls", "hold on",
        "x = cellfun(@sin, 1);",
    ],
)  # fmt: skip
def test_octave_alone_is_refused(fragment: str) -> None:
    assert problems(fragment + "\n")


EXTENSION = "octave-cli --norc --eval \"warning('on', 'Octave:language-extension'); __parse_file__('{}')\""


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="there is no Octave here")
def test_octave_finds_none_of_its_own_language(tmp_path: Path) -> None:
    (tmp_path / "wrong.m").write_text("function wrong()\n  x = 1; # one\n  x += 1;\nend\n")
    said = [
        subprocess.run(EXTENSION.format(path), shell=True, capture_output=True, text=True, check=True).stderr
        for path in (tmp_path / "wrong.m", *(ROOT / "matlab" / name for name in PROGRAMS))
    ]
    of_the_file = [answer.count("matlab/Chapter17_Lesson1") + answer.count("/wrong.m") for answer in said]
    assert of_the_file == [1, 0, 0], said  # of Octave's own files there are some more
