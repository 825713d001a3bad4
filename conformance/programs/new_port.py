# SPDX-License-Identifier: MIT
"""The skeleton of a port: a folder with port.mk, port.toml, and a program that states its contract and fails."""

import re
import tempfile
from pathlib import Path

from conformance.programs.ports import ROOT, read_ports

PORT_MK = """\
# {name}: run as it is. A compiled language has a rule for its program here, as cpp/port.mk has.
KNOWN_PORTS += {name}
FOLDER.{name} := {name}

build/{name}/done: {name}/port.toml {name}/Chapter17_Lesson1.sh
"""

PORT_TOML = """\
# Facts about the port, for the harness. {{root}} is the repository's top, as seen from build/<port>/.
[{name}]
language = "{name}"
source = "Chapter17_Lesson1.sh"       # the program, in this folder
method = "which method, which settings"
comment = ["# ", ""]                  # what begins and what ends a comment
section = "# ---- {{}} ----"            # how a section's title is written
names = "snake"                       # or camel: theta_hat, or thetaHat
constant = "{{name}} = {{value}}"         # how a constant is stated in the section Parameters
functions = {{sin = "sin({{}})", cos = "cos({{}})"}}
drawing = []                          # the lines that draw the figure, which variants leave out
products = []                         # further files that the program makes, such as its figure

[[{name}.engine]]
name = "sh"                           # what runs it, for run.json and the tables
proprietary = false
program = "sh"                        # looked for on the PATH; the first engine found is used
version = ["echo", "1"]               # a command that prints the engine's version
command = ["sh", "{{root}}/{name}/Chapter17_Lesson1.sh"]
install = "how to install it"
tolerance = {{x1 = 1e-6, x2 = 1e-6, theta_hat = 1e-6}}  # of each state's error; at most 10 times what is measured
tolerance_from = "the contract"       # where it comes from: the method's order, a solver's tolerance, the print
"""

PROGRAM = """\
# SPDX-License-Identifier: MIT
#
# Chapter 17, Lesson 1, to be written in this language. Put the program here and its command into port.toml.
#
# The program MUST
# - have the sections Parameters, Reference, Controller, Closed loop, Integrate, Write CSV, Report, in this order;
# - state each constant once, in Parameters, and have every tagged statement of the other programs, in their order, with
#   their wording and their tags (the numbers in brackets);
# - write Chapter17_Lesson1_{name}.csv into the directory it is run in, under another name until it is complete, with
#   the header t,x1,x2,theta_hat,reference,tracking_error, from t = 0 to t = 20, with round-trip precision;
# - print the four lines that the other programs print, and nothing else;
# - where it cannot, say so in one line on standard error, end with a non-zero status, and leave no CSV.

echo "Chapter17_Lesson1: the program of {name} is not written yet" >&2
exit 1
"""


def write_skeleton(name: str, root: Path = ROOT) -> list[Path]:
    """Write the folder of a new port, whole or not at all, and return its files.

    Raises ValueError for a name that is no lower-case identifier, or is taken.
    """
    if not re.fullmatch(r"[a-z][a-z0-9]{0,29}", name):
        raise ValueError(f"found the name {name!r}, expected at most 30 lower-case letters and digits, such as fortran")
    if name in taken(root):
        raise ValueError(f"found the name {name!r}, which a port, a file, or the Makefile has; expected another one")
    texts = {"port.mk": PORT_MK, "port.toml": PORT_TOML, "Chapter17_Lesson1.sh": PROGRAM}
    with tempfile.TemporaryDirectory(dir=root, prefix=".") as place:
        part = Path(place) / name
        part.mkdir()
        for file, text in texts.items():
            (part / file).write_text(text.format(name=name))
        part.rename(root / name)
    return [root / name / file for file in texts]


def taken(root: Path = ROOT) -> set[str]:
    """The names that no new port can have: those of ports, of what stands at the top, and what the Makefile keeps."""
    kept = re.findall(r"^(?:TARGETS|KEPT) := (.*)$", (root / "Makefile").read_text(), flags=re.MULTILINE)
    return {*read_ports(root), *" ".join(kept).split(), *(path.stem.lower() for path in root.iterdir())}
