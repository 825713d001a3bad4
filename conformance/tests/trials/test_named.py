# SPDX-License-Identifier: MIT
"""Whether a verdict names what was broken is told by the statement that was changed, in any port's spelling."""

import pytest

from conformance.judging.verdict import Verdict
from conformance.programs.ports import Port, read_ports
from conformance.tests.under_test import PORTS
from conformance.trials.edits import in_experiment
from conformance.trials.kill_matrix import prepare
from conformance.trials.named import is_named, mistakes, snake, words
from conformance.trials.variant import read_variants, runnable, source

pytestmark = pytest.mark.beyond

VARIANTS = read_variants()


def test_names_of_ports_are_respelled() -> None:
    spelled = {"alpha1DotKnown": "alpha1_dot_known", "THETA_TRUE": "theta_true", "gamma_gain": "gamma", "u": "u"}
    assert {name: snake(name) for name in spelled} == spelled


def test_every_mistake_has_words_that_name_it(port: Port) -> None:
    for variant in VARIANTS.values():
        if variant.refused_by and variant.has(port):
            found = words(port, in_experiment(port, variant.experiment), source(variant, port))
            assert found, variant.name
            assert not is_named(Verdict(port.name, "fail", "something is wrong"), found), variant.name


def test_first_line_alone_counts() -> None:
    port = read_ports()["cpp"]
    before = in_experiment(port, VARIANTS["no-estimate-rate"].experiment)
    wanted = words(port, before, source(VARIANTS["no-estimate-rate"], port))
    assert is_named(
        Verdict("a", "fail", "row 2 is off by +1 phi * theta_hat': that term is missing from u (7)"), wanted
    )
    assert not is_named(Verdict("a", "fail", "the update law\nu"), wanted)


def test_every_mistake_is_named_by_the_first_line(variants_have_run: None) -> None:
    port = next((port for port in runnable(PORTS.values()) if port.name in ("cpp", "java")), None)
    if port is not None:
        prepare(VARIANTS.values(), [port])
        found = mistakes(list(VARIANTS.values()), [port])
        assert found and all(found)
