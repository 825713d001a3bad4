# SPDX-License-Identifier: MIT
"""The programs read alike: same sections, same statements, same wording, in the same order."""

import re

import pytest

from conformance.ports import Port, read_ports

SECTIONS = ["Parameters", "Reference", "Controller", "Closed loop", "Integrate", "Write CSV", "Report"]
ALL = read_ports()
FIRST = next(iter(ALL.values()))

every_port = pytest.mark.parametrize("any_port", ALL.values(), ids=ALL)


def source(port: Port) -> str:
    return port.source_path.read_text(encoding="utf-8")


def sections(port: Port) -> list[str]:
    pattern = re.escape(port.section).replace(re.escape("{}"), "([A-Z][A-Za-z ]+)")
    return re.findall(f"^ *{pattern},?$", source(port), flags=re.MULTILINE)


def section(port: Port, title: str) -> str:
    """The text of a section, up to the next one."""
    titles = sections(port)
    mark = port.section.format(title)
    following = titles[titles.index(title) + 1]
    text = source(port)
    return text[text.index(mark) : text.index(port.section.format(following))]


def snake(text: str) -> str:
    return re.sub(r"(?<=[a-z0-9])([A-Z])", lambda m: "_" + m[1].lower(), text)


def statement(text: str) -> str:
    """A tagged statement without what is the language's own."""
    text = re.sub(r"\b(constexpr|const|static|final|double|return)\b", "", text)
    text = re.sub(r"\b(np\.|std::|Math\.|control\.)", "", text)
    text = re.sub(r"\b(Sin|Cos)\[([^]]*)\]", lambda m: f"{m[1].lower()}({m[2]})", text)
    text = re.sub(r'^ *Cell\["', "", text)
    return snake(" ".join(text.strip(" ;'").split()))


def steps(port: Port) -> list[tuple[str, str, str]]:
    """(tag, wording, statement) of every tagged line, in order."""
    leader, end = (re.escape(part.strip()) for part in port.comment)
    pattern = rf"^(.*?) *{leader} *(\(\d+\)) (.*?){' *' + end if end else ''}$"
    found = re.findall(pattern, source(port), flags=re.MULTILINE)
    unquoted = [(text, tag, wording.removesuffix("'").replace("''", "'") if text.lstrip()[:1] == "'" else wording)
                for text, tag, wording in found if text.strip(" %")]  # fmt: skip
    return [(tag, snake(wording), statement(text)) for text, tag, wording in unquoted]


@every_port
def test_sections_stand_in_the_common_order(any_port: Port) -> None:
    assert [title for title in sections(any_port) if title != "Figures"] == SECTIONS


@every_port
def test_statements_and_their_wording_are_the_same_in_every_program(any_port: Port) -> None:
    assert steps(any_port) == steps(FIRST)


def test_statements_cover_the_lesson() -> None:
    tags = [tag for tag, _, _ in steps(FIRST)]
    assert tags.count("(10)") == 13 and tags.count("(5)") == 2 and tags.count("(7)") == 8


@every_port
def test_constants_stand_in_the_parameters_alone(any_port: Port) -> None:
    parameters = section(any_port, "Parameters")
    elsewhere = source(any_port).replace(parameters, "")
    assert set(re.findall(r"(?<![\w.%:])\d+\.\d+|\d+e-\d+", elsewhere)) <= {"0.0"}


@every_port
def test_notation_is_explained_in_the_same_words(any_port: Port) -> None:
    assert notation(any_port) == notation(FIRST)


def notation(port: Port) -> str:
    text = source(port)
    text = text[text.index("x1' = x2") : text.index("of the lesson")]
    return snake(re.sub(r"[^\w=']+", " ", text))


@every_port
def test_controller_does_not_use_theta(any_port: Port) -> None:
    code = re.sub(re.escape(any_port.comment[0].strip()) + ".*", "", section(any_port, "Controller"))
    assert not re.search(r"\btheta\b", code)


def test_notebook_has_one_input_cell_per_section() -> None:
    styles = re.findall(r'"(Title|Text|Section|Input)"\]', source(ALL["mathematica"]))
    assert styles == ["Title", "Text", *["Section", "Input"] * (len(SECTIONS) + 1)]
