# SPDX-License-Identifier: MIT
"""A certificate holds if the solution is where it says, is refused if any digit of it is wrong, and is read safely."""

import ast
import functools
import json
import random
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
import sympy as sp
from flint import arb, arb_poly, arb_series, fmpq

from conformance.programs.ports import ROOT
from conformance.tests.truth.problems import CLOSED, Closed, x, y
from conformance.tests.truth.problems import lesson as written_lesson
from conformance.theory.experiment_file import to_toml
from conformance.theory.experiments import with_values
from conformance.theory.lesson import LESSON
from conformance.truth import certify as checker
from conformance.truth.certificate import certificate, same_problem
from conformance.truth.certify import NoCertificate, NotProven, bounds, certify, parse, run, series, written
from conformance.truth.experiment import problem
from conformance.truth.taylor import precision
from conformance.truth.truth import enclose

pytestmark = pytest.mark.beyond

SHORT = with_values(LESSON, {"horizon": Fraction(1, 4)})
Content = dict[str, Any]


@functools.cache
def certified() -> str:
    """The text of a certificate that holds."""
    return certificate(problem(SHORT), enclose(problem(SHORT), 1e-18))


def resealed(change: Callable[[Content], None]) -> str:
    """The certificate changed, its digest made to fit."""
    content = json.loads(certified())
    change(content)
    return written(content)


def forged(change: Callable[[Content], None]) -> Callable[[], str]:
    """Such a certificate when it is asked for."""
    return lambda: resealed(change)


def stated(of: checker.Certificate) -> float:
    """The largest radius that a certificate states."""
    return max(float(radius) for step in of.steps for radius in step.radius)


def largest(bounds: list[list[arb]]) -> float:
    """The largest of the bounds of all steps."""
    return max(float(bound) for step in bounds for bound in step)


# ---- What holds ----


def test_lesson_is_certified() -> None:
    lesson = problem(LESSON)
    found = parse(certificate(lesson, enclose(lesson)))  # which has checked it
    assert same_problem(lesson, found) and stated(found) <= 1e-18
    assert not same_problem(replace(lesson, start=(*lesson.start[:2], sp.S.One)), found)
    assert not same_problem(problem(with_values(LESSON, {"gamma": Fraction("3.0001")})), found)
    assert not same_problem(replace(lesson, horizon=lesson.horizon + 1), found)


def test_second_way_gives_a_smaller_radius_than_the_first() -> None:
    assert largest(certify(parse(certified()))) < stated(parse(certified()))


def test_problem_in_the_certificate_is_the_lessons() -> None:
    """The program, run at exact points, gives the right-hand sides that the lesson writes by hand."""
    claim, lesson = parse(certified()), written_lesson()
    choose = random.Random(1)
    for _ in range(5):
        point = [Fraction(choose.randint(-99, 99), choose.randint(1, 99)) for _ in range(4)]
        values = dict(zip((lesson.time, *lesson.states), map(sp.Rational, point), strict=True))
        for name, e in lesson.definitions:
            values[name] = e.xreplace(values)
        with series(128, 2):
            t, *x = (arb_series([arb(fmpq(value.numerator, value.denominator))]) for value in point)
            found = [value[0] for (value,) in run(claim.program, claim.rhs, t, [[one] for one in x])]
            assert all(
                abs(f - arb(str(sp.N(e.xreplace(values), 30)))) < 1e-25 for f, e in zip(found, lesson.rhs, strict=True)
            )


@pytest.mark.parametrize("closed", CLOSED.values(), ids=CLOSED)
def test_bound_of_rough_polynomials_covers_their_error_and_is_near_it(closed: Closed) -> None:
    """Polynomials cut to a lower degree are off by more: the second way alone has to say by how much."""
    enclosed = enclose(closed.problem, 1e-12)
    short = tuple(tuple(" ".join(p.split()[:40]) for p in step) for step in enclosed.polynomials)
    found = parse(certificate(closed.problem, replace(enclosed, polynomials=short, radius=0 * enclosed.radius + 1e-6)))
    with precision(256):
        worst = arb(0)
        for step, bounds in zip(found.steps, certify(found), strict=True):
            for share in (Fraction(0), Fraction(1, 3), Fraction(1)):
                s = step.width * fmpq(share.numerator, share.denominator)
                at = arb(step.start + s)
                if not at <= arb(fmpq(closed.problem.horizon.p, closed.problem.horizon.q)):
                    continue
                for p, exact, bound in zip(step.polynomial, closed.solution(at), bounds, strict=True):
                    error = abs(p(arb(s)) - exact)
                    assert error <= bound
                    worst = worst.max(error)
        if closed.problem.rhs[0] in (-x, y, x * (1 - x)):  # of others, the polynomials are exact or very near it
            assert largest(certify(found)) < 10_000 * worst


@pytest.mark.parametrize("order", [0, 1, 5, 12])
def test_bounds_on_a_step_hold_and_are_near_the_largest_values(order: int) -> None:
    with series(100):
        h = arb(0.75)
        ((grows, turns),) = bounds(lambda s: [[arb_series(s).exp(), arb_series(s).sin()]], h, order)
        assert h.exp() <= grows and h.sin() <= turns
        assert order < 12 or (grows < h.exp() * 1.2 and turns < h.sin() * 1.2)


@pytest.mark.parametrize("line", ["log 1", "div 2 1"])
def test_no_bound_is_given_where_an_operation_may_leave_its_domain(line: str) -> None:
    program, t = ["state 0", "add 0 0", "constant 1", line], arb_series([0])

    def values(s: arb_poly) -> list[list[arb_series]]:
        return run(program, [3], t, [[arb_series(s - 0.25)]])

    with series(100):
        try:
            assert not bounds(values, arb(1), 3)[0][0] < 1e300
        except NotProven as reason:
            assert "division by 0" in str(reason)


# ---- What does not ----


def test_wrong_digit_anywhere_is_refused() -> None:
    digits = [match.start() for match in re.finditer('[0-9a-f](?=[^"]*"[,\n])', certified())]
    choose = random.Random(0)
    for place in choose.sample(digits, 60):
        other = choose.choice([d for d in "0123456789abcdef" if d != certified()[place]])
        with pytest.raises(NoCertificate):
            parse(certified()[:place] + other + certified()[place + 1 :])


def first_coefficient(number: int, row: int, by: float) -> Callable[[Content], None]:
    def change(content: Content) -> None:
        rows = content["steps"][number]["polynomial"]
        first, _, others = rows[row].partition(" ")
        mantissa, exponent = first.split("p")
        changed = Fraction(int(mantissa, 16)) * Fraction(2) ** int(exponent) + Fraction(by)
        rows[row] = f"{changed.numerator:#x}p{1 - changed.denominator.bit_length()} {others}"

    return change


def replaced(key: str, old: str, new: str) -> Callable[[Content], None]:
    def change(content: Content) -> None:
        assert old in content[key]
        content[key] = [new if value == old else value for value in content[key]]

    return change


def narrow(content: Content) -> None:
    content["steps"][-1]["radius"][0] = "0x1p-140"


def merged(content: Content) -> None:
    """Many steps become one, on the polynomials of the first."""
    first, *others = content["steps"][1:]
    numbers = [step["width"].split("p") for step in (first, *others)]
    total = sum((Fraction(int(m, 16)) * Fraction(2) ** int(e) for m, e in numbers), Fraction(0))
    first["width"] = f"{total.numerator:#x}p{1 - total.denominator.bit_length()}"
    del content["steps"][2:]


FALSE: dict[str, Callable[[Content], None]] = {
    "a start value": lambda content: content["start"].__setitem__(0, ["13/10", "0"]),
    "a start value off by 1e-17": lambda content: content["start"].__setitem__(2, [f"1/{10**17}", "0"]),
    "a start that is a ball": lambda content: content["start"].__setitem__(0, ["6/5", f"1/{10**17}"]),
    "the first coefficient of the first step": first_coefficient(0, 0, 2.0**-59),
    "a coefficient of a later step": first_coefficient(2, 2, 2.0**-59),
    "theta": replaced("program", "constant 6/5", "constant 5999999999999999/5000000000000000"),
    "an operation": replaced("program", "mul 1 17", "add 1 17"),
    "a function": lambda content: content.update(
        program=[line.replace("sin", "cos") if line.startswith("sin") else line for line in content["program"]]
    ),
    "rows exchanged": lambda content: content["rhs"].reverse(),
    "a radius that is too small": narrow,
    "a step that is too wide": merged,
    "a frame without an inverse": lambda content: content["steps"][1].update(inverse=["0x0p0"] * 9),
    "a frame that the flow leaves": lambda content: content["steps"][1].update(
        frame=[row.split()[0] for row in content["steps"][1]["frame"]]
    ),
}


@pytest.mark.parametrize("change", FALSE.values(), ids=FALSE)
def test_what_is_false_is_refused_though_its_digest_fits(change: Callable[[Content], None]) -> None:
    try:
        found = parse(resealed(change))
    except NoCertificate:
        pytest.fail("the check has to be the mathematics'")
    with pytest.raises(NotProven):
        certify(found)


NONE: dict[str, tuple[Callable[[], str], str]] = {
    "no JSON": (lambda: "t,x1\n", "expected JSON"),
    "nested without end": (lambda: "[" * 100_000, "expected JSON"),
    "a number without end": (lambda: '{"format": ' + "9" * 100_000 + "}", "expected JSON"),
    "a list": (lambda: "[]", "the file: found '\\[\\]', expected the keys"),
    "other keys": (lambda: '{"format": 1}', "the file: .* expected the keys"),
    "another form": (lambda: json.dumps(json.loads(certified())), "expected the canonical one"),
    "a key twice": (lambda: certified().replace("{", '{"format": "x",', 1), "expected the canonical one"),
    "another format": (forged(lambda content: content.update(format="2")), "format: found '2'"),
    "no states": (forged(lambda content: content.update(states=[])), "states: .* a list of 1 to"),
    "a state that is code": (forged(lambda content: content["states"].__setitem__(0, "x();")), "states: found .*'x"),
    "an unknown operation": (forged(replaced("program", "mul 1 17", "exec 1")), "program, line .* an operation"),
    "a line that reads ahead": (forged(replaced("program", "mul 1 17", "mul 1 400")), "whole numbers below"),
    "a line of too few words": (forged(replaced("program", "mul 1 17", "mul 1")), "as many numbers"),
    "a number divided by zero": (forged(replaced("program", "constant 6/5", "constant 6/0")), "in lowest terms"),
    "a number that is code": (forged(replaced("program", "constant 6/5", "constant x()")), "in lowest terms"),
    "a number not in lowest terms": (forged(replaced("program", "constant 6/5", "constant 12/10")), "in lowest"),
    "rows too many": (forged(lambda content: content["rhs"].append(0)), "rhs: .* a list of 3"),
    "a row that is text": (forged(lambda content: content["rhs"].__setitem__(0, "0")), "rhs: found .*'0'"),
    "a row that is true": (forged(lambda content: content["rhs"].__setitem__(0, True)), "rhs: found .*True"),
    "a precision without end": (forged(lambda content: content.update(bits=10**9)), "bits: found '1000000000'"),
    "a frame of too few rows": (forged(lambda content: content["steps"][0]["frame"].pop()), "step 1, frame: .* of 9"),
    "a negative radius of a start": (forged(lambda content: content["start"][0].__setitem__(1, "-1")), "radii"),
    "steps that leave a gap": (forged(lambda content: content["steps"].pop(3)), "step 4, start"),
    "a width of zero": (forged(lambda content: content["steps"][0].update(width="0x0p0")), "step 1, width"),
    "a radius of zero": (forged(lambda content: content["steps"][0]["radius"].__setitem__(0, "0x0p0")), "radius"),
    "an even mantissa": (forged(lambda content: content["steps"][0]["radius"].__setitem__(0, "0x2p-70")), "odd"),
    "an exponent of a million": (
        forged(lambda content: content["steps"][0]["radius"].__setitem__(0, "0x1p1000000")), "step 1, radius",
    ),
    "a polynomial without coefficients": (
        forged(lambda content: content["steps"][0]["polynomial"].__setitem__(0, "")), "step 1, polynomial",
    ),
    "a state twice": (forged(lambda content: content["states"].__setitem__(1, content["states"][0])), "states: f"),
    "a horizon of nothing": (forged(lambda content: content.update(horizon="0")), "a positive time"),
    "a horizon beyond the steps": (forged(lambda content: content.update(horizon="21")), "horizon: found '21'"),
}  # fmt: skip


@pytest.mark.parametrize("case", NONE)
def test_what_is_no_certificate_is_refused_in_one_line(case: str) -> None:
    content, message = NONE[case]
    with pytest.raises(NoCertificate, match=message) as error:
        parse(content())
    assert "\n" not in str(error.value) and len(str(error.value)) < 400


UNDEFINED = {
    "0 / x, where x goes through 0": ("state 0", "constant 0", "div 1 0"),
    "0 log(-1)": ("constant -1", "log 0", "constant 0", "mul 2 1"),
}


@pytest.mark.parametrize("case", UNDEFINED)
def test_what_is_not_defined_on_all_of_the_set_is_not_passed_over_though_it_is_times_0(case: str) -> None:
    program, x = list(UNDEFINED[case]), [[arb_series([arb(0, 1)]), arb_series([1])]]
    with series(80, 3), pytest.raises(ValueError, match=r"not defined|leading term"):
        run(program, [len(program) - 1], arb_series([0, 1]), x)


# ---- The commands ----


def conformance(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, capture_output=True, text=True)


def test_commands_write_and_check_a_certificate(tmp_path: Path) -> None:
    short, path = tmp_path / "short.toml", tmp_path / "short.json"
    short.write_text(to_toml(with_values(LESSON, {"horizon": Fraction(1, 8)})))
    assert conformance("truth", "--plant", short, "--certificate", path).returncode == 0
    good = conformance("certify", path, "--plant", short)
    assert good.returncode == 0 and "short.json holds: x1, x2, theta_hat on [0, 101/800]" in good.stdout, good.stderr
    path.write_text(resealed(FALSE["theta"]))
    bad = conformance("certify", path)  # without the experiment, the mathematics' alone
    assert bad.returncode == 1 and "short.json FAILS: in the step from t = 0" in bad.stdout


def test_what_is_no_certificate_ends_with_status_2_and_one_line(tmp_path: Path) -> None:
    path = tmp_path / "no certificate"
    for content in (b"", b"\xff\xfe", b"t,x1\n", certified()[:-50].encode()):
        path.write_bytes(content)
        answer = conformance("certify", path)
        assert answer.returncode == 2 and answer.stdout == "" and len(answer.stderr.splitlines()) == 1


def test_no_file_and_a_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "none"):
        answer = conformance("certify", path)
        assert answer.returncode == 2 and "expected a file" in answer.stderr


def test_checker_is_one_small_program_that_needs_python_flint_alone() -> None:
    text = Path(checker.__file__).read_text()
    assert len(text.splitlines()) <= 300
    nodes = list(ast.walk(ast.parse(text)))
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    assert names - set(sys.stdlib_module_names) - {"collections.abc"} == {"flint"}
    program = "import sys; import conformance.truth.certify; "
    program += "print(*(name for name in sys.modules if name.startswith('conformance.') or name in ('sympy', 'numpy')))"
    answer = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True)
    assert set(answer.stdout.split()) == {"conformance.truth", "conformance.truth.certify"}
