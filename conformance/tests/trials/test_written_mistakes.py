# SPDX-License-Identifier: MIT
"""Mistakes of (16), and others, in the written programs of a plant with three states: each is refused by its check.

Here in C++; GALLERY=all makes them in every language.
"""

import os
from dataclasses import replace
from fractions import Fraction
from functools import partial

import pytest

from conformance.judging.verdict import judge_port
from conformance.programs.ports import ROOT, read_ports
from conformance.programs.writer import Program, rendered
from conformance.theory.experiment_file import read_experiment
from conformance.theory.expressions import text
from conformance.theory.reader import read
from conformance.theory.statements import statements_of
from conformance.trials.kill_matrix import refusals
from conformance.trials.variant import Job, copy_with_programs, in_tree, job, run_all, runnable

pytestmark = pytest.mark.beyond

PLANT = replace(read_experiment(ROOT / "plants" / "problem_1c.toml"), horizon=Fraction(2), facts=())
TREES = ROOT / "build" / "mistakes"
LANGUAGES = [port.name for port in runnable(read_ports(plant=PLANT.name).values())]
ASKED = LANGUAGES if os.environ.get("GALLERY") == "all" else [name for name in LANGUAGES if name == "cpp"]

BREAKS_X3, OBEYS = "x3-obeys-its-differential-equation", "{}-obeys-its-differential-equation"
MISTAKES = {  # the statement, what is wrong in it, and the check that refuses it
    "pure feedback taken for strict feedback": ("x1_dot", "x2 +", "sin(x2) +", OBEYS.format("x1")),
    "an estimate for each step": ("tau3_1", " + w3_1 * z3", "", OBEYS.format("theta1_hat")),
    "theta where its estimate belongs": ("x1_dot_known", "theta1_hat", "theta1_true", BREAKS_X3),
    "no derivative of the estimate": ("u", "alpha2_theta1_hat * theta1_hat_dot", "0 * alpha2_theta1_hat", BREAKS_X3),
    "no derivative of the other estimate": ("u", " - phi2_2 * theta2_hat_dot", "", BREAKS_X3),
    "no term of the tuning functions": ("u", " - gamma * phi1_1 * w3_1 * z2", "", BREAKS_X3),
    "a sign in a tuning function": ("tau3_1", "+ w3_1", "- w3_1", OBEYS.format("theta1_hat")),
    "theta_tilde with the other sign": ("theta2_hat_dot", "gamma", "-gamma", OBEYS.format("theta2_hat")),
    "no third derivative of the reference": ("alpha2_dot_known", " + r_dddot", "", BREAKS_X3),
    "a reference that was changed alone": ("r", "0.5", "0.4", "reference-is-that-of-the-experiment"),
    "a partial derivative that forgets a product": ("tau2_1_x1", " + phi1_1 +", " +", BREAKS_X3),
}


def mistaken(name: str, port_name: str) -> Job:
    """The program with the mistake, to be run."""
    statement, old, new, _ = MISTAKES[name]
    wrong = []
    for s in statements_of(PLANT):
        if s.name == statement:
            assert text(s.expression).count(old) == 1, text(s.expression)
            s = s._replace(expression=read(text(s.expression).replace(old, new)))
        wrong.append(s)
    program = rendered(Program(PLANT, read_ports()[port_name], wrong))
    return job(TREES / name.replace(" ", "-"), read_ports(plant=PLANT.name)[port_name], program)


@pytest.fixture(scope="session")
def mistakes_have_run() -> None:
    run_all([mistaken(name, port) for name in MISTAKES for port in ASKED], partial(copy_with_programs, PLANT))


@pytest.mark.parametrize("language", ASKED)
@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_in_a_written_program_is_refused(name: str, language: str, mistakes_have_run: None) -> None:
    port = read_ports(plant=PLANT.name)[language]
    verdict = judge_port(in_tree(port, mistaken(name, language).tree), PLANT)
    assert MISTAKES[name][-1] in refusals(verdict), f"{verdict.status}: {verdict.reason}"


@pytest.mark.parametrize("language", ASKED)
def test_without_a_mistake_it_conforms(language: str) -> None:
    port, tree = read_ports(plant=PLANT.name)[language], TREES / "none"
    right = rendered(Program(PLANT, read_ports()[language], statements_of(PLANT)))
    run_all([job(tree, port, right)], partial(copy_with_programs, PLANT))
    verdict = judge_port(in_tree(port, tree), PLANT)
    assert verdict.conforms, verdict.reason
