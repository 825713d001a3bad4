# SPDX-License-Identifier: MIT
"""Any plant: it is designed, its solution proven, a trajectory of its statements judged, and a wrong one refused.

The trajectories are SciPy's, of the statements as programs have them; the truth is derived by another way, in SymPy.
"""

import functools
import io
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from conformance.judging.checks import contract
from conformance.judging.report import read_report, report_problems
from conformance.judging.trajectory import load
from conformance.judging.verdict import Verdict, judge_file
from conformance.programs.ports import ROOT
from conformance.tests.under_test import ONE_STATE
from conformance.theory.experiment_file import read_experiment
from conformance.theory.experiments import Experiment
from conformance.theory.identity import prove
from conformance.theory.statements import parameters_of, statements_of
from conformance.theory.symbolic import to_sympy
from conformance.truth.exact import Exact, believable, exact, sampled_gains

pytestmark = pytest.mark.beyond

TARGET = 1e-12
HORIZON, STEP = 2, 0.01  # s
FULL = ((Fraction(1), Fraction(1, 4)), (Fraction(1, 4), Fraction(1, 2)))
Formulas = dict[str, sp.Expr]


@functools.cache
def experiment(name: str) -> Experiment:
    """A plant of the gallery over a short horizon; the motor's arm with a full Gamma."""
    found = replace(read_experiment(ROOT / "plants" / f"{name}.toml"), horizon=Fraction(HORIZON))
    return replace(found, Gamma=FULL) if name == "motor_arm" else found


PLANTS = {  # n, p
    "first_order": (1, 2),
    "moore_greitzer": (2, 2),  # its g is negative
    "khalil": (3, 0),
    "problem_1c": (3, 2),
    "motor_arm": (3, 2),  # its Gamma is full
}


def no_fault(formulas: Formulas) -> None:
    """The statements as they are."""


def signals(e: Experiment, fault: Callable[[Formulas], None]) -> Callable[..., list[np.ndarray]]:
    """The rates of states and estimates, and the reference, as a function of t, the states and the estimates."""
    formulas = {s.name: to_sympy(s.expression, sp.Symbol) for s in statements_of(e)}
    fault(formulas)
    numbers = {sp.Symbol(p.name): sp.Rational(p.value) for p in parameters_of(e)}
    shared = [(sp.Symbol(name), formula.xreplace(numbers)) for name, formula in formulas.items()]
    wanted = [sp.Symbol(f"{name}_dot") for name in (*e.states, *e.estimates)] + [sp.Symbol("r")]
    return sp.lambdify(sp.symbols(("t", *e.states, *e.estimates)), wanted, cse=lambda _: (shared, wanted))


def write_csv(e: Experiment, path: Path, fault: Callable[[Formulas], None] = no_fault) -> None:
    """A log of the statements, by SciPy."""
    path.write_text(log_of(e, fault))


@functools.cache
def log_of(e: Experiment, fault: Callable[[Formulas], None]) -> str:
    """The log as text."""
    function = signals(e, fault)
    start = [float(value) for value in (*e.start, *(p.start for p in e.unknown))]
    t = np.linspace(0, HORIZON, round(HORIZON / STEP) + 1)
    solved = solve_ivp(
        lambda t, x: np.array(function(t, *x)[:-1], dtype=float), (0, HORIZON), start, "DOP853", t,
        rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    r = np.array([float(function(one, *start)[-1]) for one in t])
    rows = np.column_stack([t, *solved.y, r, solved.y[0] - r])
    header = ",".join(("t", *e.states, *e.estimates, "reference", "tracking_error"))
    text = io.StringIO()
    np.savetxt(text, rows, fmt="%.17g", delimiter=",", header=header, comments="")
    return text.getvalue()


def judged(e: Experiment, folder: Path, fault: Callable[[Formulas], None] = no_fault) -> Verdict:
    path = folder / f"{e.name}.csv"
    write_csv(e, path, fault)
    return judge_file(path, e, target=TARGET, diagnose=True)


@pytest.mark.parametrize("name", PLANTS)
def test_it_is_designed_proven_and_its_trajectory_conforms(name: str, tmp_path: Path) -> None:
    e, (n, p) = experiment(name), PLANTS[name]
    prove(e, statements_of(e))
    verdict = judged(e, tmp_path)
    assert verdict.status == "pass", verdict.reason
    claims = [result.claim for result in verdict.results]
    assert len(claims) == len(set(claims))
    assert sum(claim.endswith("-obeys-its-differential-equation") for claim in claims) == n + p
    assert sum(claim.startswith("z") for claim in claims) == n
    assert [claim for claim in claims if "estimate" in claim] == ["estimate-stays-bounded"] * bool(p)
    assert list(verdict.errors) == [*e.states, *e.estimates]
    assert "parameters-are-those-of-the-experiment" in claims


# ---- What is wrong is refused, by the check that it belongs to ----


def dropped(name: str, term: int) -> Callable[[Formulas], None]:
    def fault(formulas: Formulas) -> None:
        sum_ = sp.expand(formulas[name])
        formulas[name] = sum_ - sum_.as_ordered_terms()[term]

    return fault


def negated(name: str) -> Callable[[Formulas], None]:
    def fault(formulas: Formulas) -> None:
        formulas[name] = -formulas[name]

    return fault


def replaced(name: str, old: str, new: str) -> Callable[[Formulas], None]:
    def fault(formulas: Formulas) -> None:
        assert sp.Symbol(old) in formulas[name].free_symbols
        formulas[name] = formulas[name].xreplace({sp.Symbol(old): sp.sympify(new)})

    return fault


FAULTS: Mapping[str, tuple[str, Callable[[Formulas], None], tuple[str, ...]]] = {  # the plant, and whose rows break
    "a term of u dropped": ("problem_1c", dropped("u", 0), ("x3",)),
    "a term of u dropped, n = 1": ("first_order", dropped("u", 0), ("excess",)),
    "a term of u dropped, p = 0": ("khalil", dropped("u", 1), ("x3",)),
    "a sign in the update law": ("problem_1c", negated("theta2_hat_dot"), ("theta2_hat",)),
    "a sign in a tuning function": ("first_order", negated("tau1_1"), ("theta1_hat",)),
    "an entry of Gamma": ("motor_arm", replaced("B_hat_dot", "gamma22", "1"), ("B_hat",)),
    "another row 1": ("problem_1c", replaced("x1_dot", "x2", "sin(x2)"), ("x1",)),
    "another row 2": ("motor_arm", replaced("v_dot", "N_true", "1"), ("v",)),
    "a weaker input": ("moore_greitzer", replaced("pressure_dot", "u", "0.9*u"), ("pressure",)),
}


@pytest.mark.parametrize("case", FAULTS)
def test_what_is_wrong_is_refused_by_its_check(case: str, tmp_path: Path) -> None:
    name, fault, names = FAULTS[case]
    verdict = judged(experiment(name), tmp_path, fault)
    failed = [result.claim for result in verdict.results if not result.passed]
    broken = [claim for claim in failed if claim.endswith("-obeys-its-differential-equation")]
    assert verdict.status == "fail" and broken == [f"{state}-obeys-its-differential-equation" for state in names]


def test_another_reference_is_refused(tmp_path: Path) -> None:
    verdict = judged(experiment("khalil"), tmp_path, lambda formulas: formulas.update(r=sp.Rational(1, 9)))
    assert "reference-is-that-of-the-experiment (10) FAILS" in verdict.reason


def changed(name: str, folder: Path, change: Callable[[np.ndarray], None]) -> list[str]:
    """The claims that fail of a right log once its rows, shape (rows, columns), are changed."""
    e = experiment(name)
    path = folder / "changed.csv"
    write_csv(e, path)
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    change(rows)
    header = path.read_text().partition("\n")[0]
    np.savetxt(path, rows, fmt="%.17g", delimiter=",", header=header, comments="")
    return [r.claim for r in judge_file(path, e, target=TARGET).results if not r.passed]


def test_an_estimate_outside_of_the_ellipsoid_of_Gamma_is_refused(tmp_path: Path) -> None:
    """Along the short axis of the ellipsoid, where each estimate alone is within its own bound."""
    solution = solved("motor_arm")
    V0, Gamma = solution.V_start, np.array(FULL, dtype=float)
    _, axes = np.linalg.eigh(Gamma)
    short = axes[:, 0] * 0.9 * np.sqrt(2 * V0 * Gamma.diagonal().min())

    def change(rows: np.ndarray) -> None:
        rows[50, 4:6] = solution.setting.theta + short

    assert (np.abs(short) < np.sqrt(2 * V0 * Gamma.diagonal())).all()
    assert "estimate-stays-bounded" in changed("motor_arm", tmp_path, change)


def test_errors_that_stay_away_are_refused(tmp_path: Path) -> None:
    def change(rows: np.ndarray) -> None:
        rows[-20:, 3] += 3.0

    failed = changed("khalil", tmp_path, change)
    assert {"z3-approaches-zero", "lyapunov-function-never-grows", "x3-equals-the-exact-solution"} <= set(failed)
    assert not {"z1-approaches-zero", "z2-approaches-zero", "output-approaches-reference"} & set(failed)


# ---- What is kept, and what it is held to ----


def solved(name: str) -> Exact:
    return exact(experiment(name), TARGET)


def test_the_tolerance_is_of_each_states_size() -> None:
    tolerance = solved("first_order").tolerance
    largest = np.abs(solved("first_order").evaluate(np.linspace(0, HORIZON, 2001))).max(axis=1)
    assert np.allclose(tolerance, 1e-6 * np.maximum(1, largest), rtol=1e-2) and tolerance.max() > 1e-6
    assert contract(solved("first_order")) == tuple(tolerance)
    stated = replace(experiment("first_order"), tolerance=Fraction(1, 10**7))
    assert contract(exact(stated, TARGET)) == (1e-7,) * 3


@pytest.mark.parametrize("name", PLANTS)
def test_derivatives_of_the_derived_functions_are_those_of_differences(name: str) -> None:
    x, h = solved(name), 1e-5
    t = np.array([0.3, 1.1])
    states = x.evaluate(t)
    ahead, behind = (x.evaluate(t + d) for d in (h, -h))
    assert np.allclose((ahead - behind) / (2 * h), x.first(t, states), rtol=1e-6, atol=1e-7)
    rate = (x.first(t + h, ahead) - x.first(t - h, behind)) / (2 * h)
    assert np.allclose(rate, x.second(t, states), rtol=1e-5, atol=1e-6)
    fall = (x.lyapunov(t + h, ahead) - x.lyapunov(t - h, behind)) / (2 * h)
    assert np.allclose(-fall, x.dissipation(t, states)[0], rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("name", ["first_order", "khalil"])
def test_proven_gains_are_not_below_the_slopes_at_samples_and_near_the_largest(name: str) -> None:
    found = solved(name)
    seen = sampled_gains(found, 20001)
    for slopes in ("field", "z", "V", "dissipated"):
        proven, largest = getattr(found.gains, slopes), getattr(seen, slopes)
        assert (proven >= largest * (1 - 1e-6)).all() and (proven <= 1.02 * largest + 1e-6).all(), slopes


@pytest.mark.parametrize(
    "damage",
    [
        lambda x: replace(x, table=replace(x.table, polynomial=x.table.polynomial + 1e-9)),
        lambda x: replace(x, table=replace(x.table, bound=x.table.bound[:2])),
        lambda x: replace(x, gains=replace(x.gains, field=0.9 * x.gains.field)),
        lambda x: replace(x, gains=replace(x.gains, dissipated=2 * x.gains.dissipated + 1)),
        lambda x: replace(x, gains=sampled_gains(solved("moore_greitzer"), 101)),
    ],
    ids=["a shift", "a state left out", "smaller gains", "larger gains", "gains of another plant"],
)
def test_what_is_kept_is_checked(damage: Callable[[Exact], Exact]) -> None:
    assert believable(solved("problem_1c")) and not believable(damage(solved("problem_1c")))


# ---- Standard output ----

SAID = {
    "problem_1c": "Final tracking error: {error:.6e}\nFinal parameter estimate: {a:.8f}, {b:.8f}\n"
    "True parameter: 0.5, 0.5\nData written to problem_1c.csv\n",
    "khalil": "Final tracking error: {error:.6e}\nData written to khalil.csv\n",
}


def said(name: str, folder: Path, edit: Callable[[str], str] = str) -> list[str]:
    e = experiment(name)
    write_csv(e, folder / f"{name}.csv")
    log = load(folder / f"{name}.csv", e)
    a, b = log.states[-2:, -1]
    (folder / "stdout.txt").write_text(edit(SAID[name].format(error=log.tracking_error[-1], a=a, b=b)))
    return report_problems(read_report(folder / "stdout.txt")[0], log, e, f"{name}.csv")


@pytest.mark.parametrize("name", SAID)
def test_what_is_printed_says_the_same(name: str, tmp_path: Path) -> None:
    assert said(name, tmp_path) == []


def test_a_parameter_that_is_no_decimal_is_printed_rounded(tmp_path: Path) -> None:
    own = experiment("problem_1c")
    e = replace(own, unknown=tuple(parameter._replace(true=Fraction(1, 3)) for parameter in own.unknown))
    write_csv(own, tmp_path / "a.csv")
    log = load(tmp_path / "a.csv", e)
    a, b = log.states[-2:, -1]
    lines = SAID["problem_1c"].format(error=log.tracking_error[-1], a=a, b=b).replace("problem_1c.csv", "a.csv")
    for text, fits in (("0.3333333333", True), ("0.333333", True), ("0.33333", False), ("0.3333334", False)):
        printed = lines.replace("0.5, 0.5", f"{text}, {text}").splitlines()
        assert (report_problems(printed, log, e, "a.csv") == []) is fits, text


WRONG = {
    "the second estimate": (
        "problem_1c",
        r"(Final parameter estimate: .*), .*",
        r"\1, 0.12345678",
        "parameter estimate",
    ),
    "one estimate only": ("problem_1c", r"(Final parameter estimate: .*), .*", r"\1", "2 numbers separated by ', '"),
    "a parameter": ("problem_1c", "0.5, 0.5", "0.5, 0.6", "true parameter: found 0.6, expected 0.5"),
    "an estimate of nothing": ("khalil", r"\nData", r"\nTrue parameter: 0.5\nData", "line 2: found 'True parameter"),
    "a line missing": ("khalil", r"Data.*", "", "found 1 of the two lines"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_printed_and_wrong_is_refused(case: str, tmp_path: Path) -> None:
    name, pattern, text, reason = WRONG[case]
    problems = said(name, tmp_path, lambda whole: re.sub(pattern, text, whole))
    assert any(reason in problem for problem in problems), problems


# ---- Commands ----


def conformance(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "conformance", *words], cwd=ROOT, capture_output=True, text=True)


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    path = tmp_path / "one.toml"
    path.write_text(ONE_STATE)
    return path


def test_the_command_judges_a_csv_of_any_plant(plant: Path, tmp_path: Path) -> None:
    write_csv(read_experiment(plant), tmp_path / "one.csv")
    answer = conformance("validate", tmp_path / "one.csv", "--plant", plant)
    assert (answer.returncode, answer.stderr) == (0, "") and answer.stdout.endswith("one.csv conforms\n")
    assert "estimate-stays-away-from-theta (9) holds" in answer.stdout
    answer = conformance("validate", tmp_path / "one.csv")
    assert answer.returncode == 1 and "missing x1 x2 theta_hat; unknown level c_hat" in answer.stdout


def test_the_command_prints_the_truth_of_any_plant(plant: Path) -> None:
    answer = conformance("truth", "--plant", plant, "--times", "0,1/3,2", "--digits", "8")
    lines = answer.stdout.splitlines()
    assert (answer.returncode, answer.stderr, len(lines)) == (0, "", 4)
    assert lines[0] == "t," + ",".join(f"{name},{name}_radius" for name in ("level", "c_hat", "z1", "V"))
    assert lines[1].startswith("0,0.2") and ",0.14500000," in lines[1]  # V(0) = (0.2^2 + 0.5^2) / 2


def test_a_certificate_of_any_plant_is_checked(plant: Path, tmp_path: Path) -> None:
    assert conformance("truth", "--plant", plant, "--certificate", tmp_path / "proof").returncode == 0
    answer = conformance("certify", tmp_path / "proof", "--plant", plant)
    assert answer.returncode == 0 and "level, c_hat on [0, " in answer.stdout, answer.stderr
    plant.write_text(ONE_STATE.replace("0.2", "0.20001"))
    answer = conformance("certify", tmp_path / "proof", "--plant", plant)
    assert answer.returncode == 1 and "it is of another problem than" in answer.stdout


@pytest.mark.parametrize("command", [["truth"], ["validate", "one.csv"]])
def test_a_fault_of_the_file_is_shown_at_its_place(command: list[str], plant: Path, tmp_path: Path) -> None:
    plant.write_text(ONE_STATE.replace("c*level^3", "c*level^"))
    (tmp_path / "one.csv").write_text("")
    words = [tmp_path / word if word.endswith(".csv") else word for word in command]
    answer = conformance(*words, "--plant", plant)
    assert (answer.returncode, answer.stdout) == (2, "")
    assert f"{plant}:5:" in answer.stderr and "^" in answer.stderr and "Traceback" not in answer.stderr


def test_a_design_that_nobody_reads_is_refused_unless_asked_for(tmp_path: Path) -> None:
    plant = tmp_path / "long.toml"
    rows = "\n".join(f'x{i} = "x{i + 1} + theta*x{i}^2"' for i in range(1, 6))
    text = ONE_STATE.replace('level = "u - c*level^3"', f'{rows}\nx6 = "u"').replace("c = [", "theta = [")
    text = text.replace('["1"]', "[1, 1, 1, 1, 1, 1]").replace('["0.2"]', "[0, 0, 0, 0, 0, 0]")
    plant.write_text(text)
    answer = conformance("truth", "--plant", plant)
    assert (answer.returncode, answer.stdout) == (2, "")
    assert "expected at most 120; --large asks for more" in answer.stderr and len(answer.stderr.splitlines()) == 1
