# SPDX-License-Identifier: MIT
"""A design as an ordered list of statements, in the lesson's own form: what the programs of every language write.

For any n and p, with alpha_0 = r:

    alpha_i_dot_known = sum_j alpha_i_xj (f_j + g_j x_{j+1} + theta_hat' phi_j) + the terms in r', r'', ...
    alpha_i = (alpha_{i-1}_dot_known - g_{i-1} z_{i-1} - k_i z_i - f_i - theta_hat' phi_i
               + alpha_{i-1}_theta_hat Gamma tau_i + sum_{2<=j<i} alpha_{j-1}_theta_hat Gamma w_i z_j) / g_i

which is the recursion (8). Terms of 0 and factors of 1 are not written; partial derivatives have names and are computed
from names; what is used once, and is no object of the lesson's, is written where it is used.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import islice, pairwise
from typing import NamedTuple

from conformance.theory import expressions
from conformance.theory.experiments import INPUT, Experiment, Unknown
from conformance.theory.expressions import (
    ONE,
    ZERO,
    Expression,
    Name,
    Negative,
    Number,
    Product,
    Quotient,
    Sum,
    add,
    derivative,
    names_in,
    negative,
    operations,
    product,
    quotient,
    substitute,
    terms_of,
)
from conformance.theory.faults import DesignError

LARGE = 120  # statements
SHORT = 3  # operations of a partial derivative that is written where it is used
REFERENCE, REGRESSOR, CONTROLLER, PLANT = "reference", "regressor", "controller", "plant"  # sections, in their order
STEP_TAG = {1: "(6)", 2: "(7)"}  # of a design with so many steps; (8) for more
ENTRY = "entry of the adaptation gain"
OWN = "(0)"  # in the place of a section of the lesson: numbers of the experiment's own


class Statement(NamedTuple):
    """One line of a program: what it defines, the section it belongs to, the lesson's section, and a few words.

    The remark, if there is one, is a sentence for the line above.
    """

    name: str
    expression: Expression
    section: str
    tag: str
    wording: str
    remark: str = ""

    def __str__(self) -> str:
        return f"{self.name} = {expressions.text(self.expression)}"


class Parameter(NamedTuple):
    """One constant of the programs: its name, its value, the lesson's section, a few words, and its unit or nothing."""

    name: str
    value: Fraction
    tag: str
    wording: str
    unit: str

    @property
    def by_itself(self) -> str:
        """The words where the name does not stand beside them: of the reference there may be several constants."""
        return f"{self.name} {self.wording}" if self.wording.startswith("of ") else self.wording


class TooLarge(DesignError):
    """A design of more statements than anyone reads."""


@dataclass(frozen=True)
class Form:
    """The plant's f_i, g_i (n each) and phi_i (n rows of p), as expressions in their author's order; (2)."""

    f: tuple[Expression, ...]
    g: tuple[Expression, ...]
    phi: tuple[tuple[Expression, ...], ...]


# ------------------------------------------------------------------ f, g and phi as the author wrote them


@functools.lru_cache(64)
def ordered_form(experiment: Experiment) -> Form:
    """Read f_i, g_i and phi_i off the rows of a plant that is in strict-feedback form; raises DesignError.

    A row that looks at a name in vain, such as x3 - x3, is read with 0 in its place.
    """
    f, g, phi = [], [], []
    parameters = [parameter.name for parameter in experiment.unknown]
    for i, row in enumerate(experiment.rows, 1):
        ahead = (*experiment.states[i:], INPUT)
        zero = dict.fromkeys((*ahead, *parameters), ZERO)
        following = (*experiment.states, INPUT)[i]
        try:
            f.append(substitute(row, zero))
            g.append(substitute(slope(row, following), zero))
            phi.append(tuple(substitute(slope(row, name), zero) for name in parameters))
        except ZeroDivisionError:
            raise DesignError(f"row {i}: it divides by names that cancel out; write it without them") from None
    return Form(tuple(f), tuple(g), tuple(phi))


def slope(e: Expression, name: str) -> Expression:
    """The partial derivative of an expression with respect to a name."""
    return derivative(e, lambda other: ONE if other == name else ZERO)


# ------------------------------------------------------------------ names


def reference_names(count: int) -> tuple[str, ...]:
    """The names of r and its derivatives: r, r_dot, r_ddot, .."""
    return ("r", *(f"r_{'d' * order}ot" for order in range(1, count)))


class Names:
    """The names of what the design defines, in snake case; an index is left out where there is but one."""

    def __init__(self, experiment: Experiment) -> None:
        self.n, self.p = len(experiment.states), len(experiment.unknown)
        rows = [i for i, row in enumerate(ordered_form(experiment).phi) if any(e != ZERO for e in row)]
        self.rows = len(rows)

    def phi(self, i: int, j: int) -> str:
        """The regressor of parameter j in row i, from 1: phi, or phi2, phi_1, phi2_1."""
        return "phi" + (str(i) if self.rows > 1 else "") + (f"_{j}" if self.p > 1 else "")

    def component(self, name: str, i: int, j: int) -> str:
        """Component j of w_i or tau_i, from 1."""
        return f"{name}{i}" + (f"_{j}" if self.p > 1 else "")


def parameters_of(experiment: Experiment) -> tuple[Parameter, ...]:
    """The constants that the programs state: true parameters, gains, the file's constants, starts, horizon."""
    said = {meaning.name: meaning for meaning in experiment.symbols}
    found = []

    def put(name: str, value: Fraction, wording: str, unit: str = "") -> None:
        found.append(Parameter(name, value, experiment.section or OWN, wording, unit))

    def unit(name: str) -> str:
        return said[name].unit if name in said else ""

    size = range(1, len(experiment.unknown) + 1)
    entries = [[experiment.gamma(i, j) for j in size] for i in size]
    for parameter in experiment.unknown:
        which = "parameter" if len(experiment.unknown) == 1 else parameter.name
        put(f"{parameter.name}_true", parameter.true, f"true {which}, unknown to the controller", unit(parameter.name))
    for i, gain in enumerate(experiment.k, 1):
        put(f"k{i}", gain, f"gain on z{i}, positive")
    for name, gain in experiment.gammas.items():
        both = [q for q, row in zip(experiment.parameters, entries, strict=True) if name in row]
        put(name, gain, "adaptation gain, positive" if name == "gamma" else f"{ENTRY}, for {_listed(both)}")
    for name, number in experiment.constants:
        put(name, number, said[name].text if name in said else "known constant", unit(name))
    for name, start in zip(experiment.states, experiment.start, strict=True):
        put(f"{name}_start", start, f"{name} at t = 0", unit(name))
    for parameter in experiment.unknown:
        put(f"{parameter.estimate}_start", parameter.start, f"{parameter.estimate} at t = 0")
    put("final_time", experiment.horizon, "horizon", "s")
    return tuple(found)


# ------------------------------------------------------------------ names with derivatives


def is_simple(e: Expression) -> bool:
    """True for what needs no name: a number, a name, and a number times a name, of either sign."""
    _, rest = expressions.split_number(e)
    return isinstance(rest, Name) or rest == ONE


class Chain:
    """Definitions, each in variables and earlier names, with their partial derivatives by the chain rule, named too."""

    def __init__(self, variables: Sequence[str], limit: int | None) -> None:
        self.order = {v: i for i, v in enumerate(variables)}
        self.limit = limit
        self.definitions: dict[str, Expression] = {}
        self.notes: dict[str, tuple[str, str]] = {}
        self.remarks: dict[str, str] = {}
        self.step = 0
        self.step_of: dict[str, int] = {}  # in which each was defined
        self.kept: set[str] = set()
        self.depends: dict[str, frozenset[str]] = {v: frozenset([v]) for v in variables}
        self.partials: dict[tuple[str, tuple[str, ...]], Expression] = {}
        self.origin: dict[str, tuple[str, tuple[str, ...]]] = {}

    def let(self, name: str, e: Expression, tag: str, wording: str, keep: bool = False) -> Expression:
        """Name an expression and return the name; what is simple stays without, unless it is to be kept."""
        if is_simple(e) and not keep:
            return e
        if name in self.depends:
            raise DesignError(f"the name {name} would mean two things; rename a state or a parameter")
        if self.limit is not None and len(self.definitions) > 10 * self.limit:
            raise TooLarge(_too_large(f"more than {self.limit}"))
        self.definitions[name] = e
        self.notes[name] = tag, wording
        self.step_of[name] = self.step
        self.depends[name] = frozenset().union(*(self.depends.get(s, frozenset()) for s in names_in(e)))
        if keep:
            self.kept.add(name)
        return Name(name)

    def partial(self, e: Expression, v: str) -> Expression:
        """The partial derivative of an expression, in names."""
        return derivative(e, lambda name: self.rate(name, v))

    def rate(self, name: str, v: str) -> Expression:
        """The partial derivative of a name."""
        if name == v:
            return ONE
        if v not in self.depends.get(name, ()) or name not in self.definitions:
            return ZERO
        base, orders = self.origin.get(name, (name, ()))
        return self.mixed(base, tuple(sorted((*orders, v), key=self.order.__getitem__)))

    def mixed(self, base: str, key: tuple[str, ...]) -> Expression:
        """A partial derivative of any order; kept once, whatever the order of its variables."""
        if not key:
            return Name(base)
        if (base, key) not in self.partials:
            lower = self.mixed(base, key[:-1])
            named = isinstance(lower, Name) and (lower.name == base or lower.name in self.origin)
            e = (
                self.of_definition(lower.name, key[-1])
                if named and isinstance(lower, Name)
                else self.partial(lower, key[-1])
            )
            name = "_".join((base, *key))
            times = {1: "", 2: "second ", 3: "third "}.get(len(key), f"{len(key)}th ")
            wording = f"{times}partial derivative of {base} by {_by(key)}"
            result = self.let(name, e, self.notes[base][0], wording)
            self.partials[base, key] = result
            if result == Name(name):
                self.origin[name] = base, key
        return self.partials[base, key]

    def of_definition(self, name: str, v: str) -> Expression:
        """The partial derivative of what a name stands for; that of a quotient is in terms of the name itself."""
        e = self.definitions[name]
        if isinstance(e, Quotient):
            over, under = self.partial(e.over, v), self.partial(e.under, v)
            return quotient(add(over, negative(product(Name(name), under))), e.under)
        return self.partial(e, v)

    def short(self, name: str, e: Expression) -> bool:
        """True for what may be written where it is used: all but long partial derivatives."""
        return name not in self.origin or operations(e) <= SHORT

    def gradient(self, e: Expression, variables: Iterable[str], keep: bool) -> list[Expression]:
        """The partial derivatives with respect to the variables; named for good if they are to be kept."""
        found = [self.partial(e, v) for v in variables]
        if keep:
            self.kept.update(d.name for d in found if isinstance(d, Name) and d.name in self.definitions)
        return found


# ------------------------------------------------------------------ the recursion (8)


def statements_of(experiment: Experiment, large: bool = False) -> tuple[Statement, ...]:
    """The statements of an experiment's reference, controller and plant, in an order in which they can be computed.

    Raises TooLarge for more than 120 of the controller, unless `large`; DesignError for names that clash.
    """
    return recursion_of(experiment, large).statements


@functools.lru_cache(32)
def recursion_of(experiment: Experiment, large: bool = False) -> Recursion:
    """The recursion (8) carried out, with all its objects; raises as `statements_of` does."""
    return Recursion(experiment, large)


class Recursion:
    """All objects of the recursion, and the `statements` that come of it.

    Counted from 1 as in the lesson; index 0 holds alpha_0 = r, tau_0 = 0, and z_0 = g_0 = 0 for the first step.
    """

    def __init__(self, experiment: Experiment, large: bool) -> None:
        self.experiment = experiment
        self.n, self.p = len(experiment.states), len(experiment.unknown)
        self.names = Names(experiment)
        self.tag = STEP_TAG.get(self.n, "(8)")
        self.limit = None if large else LARGE
        self.reference = dict(zip(reference_names(self.n + 1), _derivatives(experiment, self.n + 1), strict=True))
        self.r: list[Expression] = [
            ZERO if e == ZERO and name != "r" else Name(name) for name, e in self.reference.items()
        ]
        varying = [r.name for r in self.r if isinstance(r, Name)]
        self.chain = Chain((*experiment.states, *experiment.estimates, *varying), self.limit)
        self.x: list[Expression] = [ZERO, *map(Name, experiment.states)]
        self.f: list[Expression] = [ZERO]
        self.g: list[Expression] = [ZERO]
        self.phi: list[list[Expression]] = [[ZERO] * self.p]
        self.regressors: set[str] = set()
        self.rows: list[Expression] = [ZERO]  # f_i + g_i x_{i+1} + theta_hat' phi_i
        self.z: list[Expression] = [ZERO]
        self.w: list[list[Expression]] = [[ZERO] * self.p]
        self.tau: list[list[Expression]] = [[ZERO] * self.p]
        self.alpha: list[Expression] = [self.r[0]]
        self.by_estimate: list[list[Expression]] = [[ZERO] * self.p]  # d alpha_i / d theta_hat

        for i in range(1, self.n + 1):
            self.chain.step = i
            self.read_row(i)
            self.step(i)
        self.statements = self.written()

    def written(self) -> tuple[Statement, ...]:
        """The statements, without what nobody needs, and with what is used once where it is used."""
        definitions = _shortened(self.chain, self.outputs())
        while others := self.companions(definitions) - self.chain.kept:
            self.chain.kept |= others
            definitions = _shortened(self.chain, self.outputs())
        if self.limit is not None and len(definitions) > self.limit:
            raise TooLarge(_too_large(str(len(definitions))))
        regressors = [name for name in definitions if name in self.regressors]
        ordered = [*regressors, *(name for name in definitions if name not in self.regressors)]
        if self.n > 2:
            self.remark_on_steps(ordered[len(regressors) :])
        return (
            *self.reference_statements(),
            *(self.statement(name, definitions[name]) for name in ordered),
            *self.plant_statements(),
        )

    def companions(self, written: Iterable[str]) -> set[str]:
        """Those of which one has a name of its own all have: entries of a w_i or a tau_i, and the rows as known.

        An entry that is 0, or a regressor, needs none.
        """
        steps, entries = range(1, self.n + 1), range(1, self.p + 1)
        together = [{self.names.component(of, i, j) for j in entries} for of in ("w", "tau") for i in steps]
        together.append({f"{state}_dot_known" for state in self.experiment.states})
        found = (names for names in together if names.intersection(written))
        return set().union(*found) & self.chain.definitions.keys()

    def statement(self, name: str, e: Expression) -> Statement:
        """A definition as a statement of its section."""
        section = REGRESSOR if name in self.regressors else CONTROLLER
        return Statement(name, e, section, *self.chain.notes[name], self.chain.remarks.get(name, ""))

    def outputs(self) -> tuple[str, ...]:
        """The names that must be there: the errors, the control and the update law."""
        return (*(f"z{i}" for i in range(1, self.n + 1)), INPUT, *(f"{name}_dot" for name in self.experiment.estimates))

    def read_row(self, i: int) -> None:
        """Name f_i, g_i and phi_i, (2) and (4)."""
        form, let, following = ordered_form(self.experiment), self.chain.let, (*self.experiment.states, INPUT)[i]
        self.f.append(let(f"f{i}", form.f[i - 1], "(2)", f"known part of row {i}"))
        self.g.append(let(f"g{i}", form.g[i - 1], "(2)", f"gain of row {i}, on {following}"))
        entries = enumerate(form.phi[i - 1], 1)
        self.phi.append([self.regressor(i, j, e) for j, e in entries])

    def regressor(self, i: int, j: int, e: Expression) -> Expression:
        """Entry j of phi_i; a number needs no name."""
        if isinstance(e, Number) or (isinstance(e, Negative) and isinstance(e.of, Number)):
            return e
        wording = self.of("regressor", self.experiment.unknown[j - 1].name)
        where = f", row {i}" if self.names.rows > 1 else ""
        self.regressors.add(self.names.phi(i, j))
        return self.chain.let(self.names.phi(i, j), e, "(4)", wording + where, keep=True)

    def step(self, i: int) -> None:
        """Step i of the recursion: z_i, w_i, tau_i, the known part of alpha_{i-1}', and alpha_i, which is u at last."""
        let, last = self.chain.let, i == self.n
        wording = "tracking error" if i == 1 else "deviation from the virtual control"
        self.z.append(let(f"z{i}", add(self.x[i], negative(self.alpha[i - 1])), "(5)", wording, keep=True))
        by_state = self.chain.gradient(self.alpha[i - 1], self.experiment.states[: i - 1], keep=True)
        by_reference = self.chain.gradient(self.alpha[i - 1], [a.name for a, _ in self.varying()], keep=True)
        self.by_estimate.append(self.chain.gradient(self.alpha[i - 1], self.experiment.estimates, keep=True))
        self.remark_on_slopes(i)
        self.w.append([self.regressor_error(i, j, by_state) for j in range(self.p)])
        self.tau.append([self.tuning_function(i, j) for j in range(self.p)])
        rates = self.update_law() if last else self.adapted(self.tau[i])
        known = self.known_part(i, by_state, by_reference)
        terms = [
            negative(product(self.g[i - 1], self.z[i - 1])),
            negative(product(Name(f"k{i}"), self.z[i])),
            negative(self.f[i]),
            *(negative(term) for term in self.estimated(i)),
        ]
        terms = [*terms, known] if i == 1 else [known, *terms]
        moved = self.paired(self.by_estimate[i], rates if last else self.tau[i], scaled=not last)
        lacking = add(
            *(product(self.paired(self.by_estimate[j], self.w[i], scaled=True), self.z[j]) for j in range(2, i))
        )
        alpha = quotient(add(*terms, moved, lacking), self.g[i])
        wording = "control" if last else "virtual control"
        name = INPUT if last else f"alpha{i}"
        self.alpha.append(let(name, alpha, self.tag, wording, keep=True))
        self.remark_on_adaptation(name, i, moved, lacking)

    def remark_on_steps(self, names: Sequence[str]) -> None:
        """Say where each step begins, and what it is for."""
        for i in range(1, self.n + 1):
            first = next(name for name in names if self.chain.step_of[name] == i)
            if i < self.n:
                aim = f"z{i}, and alpha{i} for {self.experiment.states[i]} to follow"
            elif self.p:
                aim = f"z{i}, the update law{'s' if self.p > 1 else ''}, and u"
            else:
                aim = f"z{i} and u"
            self.chain.remarks[first] = f"step {i} of {self.n}: {aim}"

    def remark_on_adaptation(self, name: str, i: int, moved: Expression, lacking: Expression) -> None:
        """Say which terms of alpha_i are there because the estimate moves; (16), 4.

        alpha_{i-1} moves with it, by Gamma tau_n in the end, for which tau_i stands before; and the tau of earlier
        virtual controls lack w_i z_i.
        """
        last = len(terms_of(lacking)) if lacking != ZERO else 0
        said = [self.on_motion(i, len(terms_of(moved)), last)] if moved != ZERO else []
        said += [self.on_lack(name, i, last)] if last else []
        if said:
            self.chain.remarks[name] = "; ".join(said)

    def on_motion(self, i: int, count: int, last: int) -> str:
        """So many terms of alpha_i, before the last ones, answer the motion of alpha_{i-1} with the estimate."""
        moving = [j for j, d in enumerate(self.by_estimate[i]) if d != ZERO]
        estimates = [self.experiment.estimates[j] for j in moving]
        several = len(moving) > 1
        which = _last(count, before=last)
        if i == self.n and (last or several):
            rates = _listed([f"{e}_dot" for e in estimates]) if len(moving) < 3 else "their derivatives"
            which = f"the term{'s' * several} with {rates}"
        cause = f"alpha{i - 1} moves with {_listed(estimates)} too: hence {which}"
        if i == self.n:
            return cause
        final = f"{self.components('tau', self.n, moving)} need{'s' * (not several)} alpha{i} itself"
        return f"{cause}, with {self.components('tau', i, moving)} since {final}"

    def on_lack(self, name: str, i: int, last: int) -> str:
        """So many last terms of alpha_i, or u, make up for what the tau of earlier virtual controls lack."""
        lacked = [a for a in range(self.p) if any(self.by_estimate[j][a] != ZERO for j in range(2, i))]
        added = " and ".join(f"{self.names.component('w', i, a + 1)} z{i}" for a in lacked)
        earlier = " and ".join(self.components("tau", j, lacked) for j in range(2, i))
        one = i == 3 and len(lacked) == 1
        return f"{_last(last)} of {name} make{'s' * (last == 1)} up for {added}, which {earlier} lack{'s' * one}"

    def components(self, name: str, i: int, which: Sequence[int]) -> str:
        """Components of w_i or tau_i, from 0, as a sentence lists them."""
        return _listed([self.names.component(name, i, j + 1) for j in which])

    def estimated(self, i: int) -> list[Expression]:
        """The terms of theta_hat' phi_i."""
        return [product(Name(s), phi) for s, phi in zip(self.experiment.estimates, self.phi[i], strict=True)]

    def regressor_error(self, i: int, j: int, by_state: Sequence[Expression]) -> Expression:
        """w_i = phi_i - sum_{l<i} alpha_{i-1}_xl phi_l, entry j from 0; (8)."""
        parts = (negative(product(by_state[m - 1], self.phi[m][j])) for m in range(1, i))
        name, wording = self.names.component("w", i, j + 1), self.of("regressor", self.experiment.unknown[j].name)
        return self.chain.let(name, add(self.phi[i][j], *parts), self.tag, f"{wording} in z{i}'")

    def tuning_function(self, i: int, j: int) -> Expression:
        """tau_i = tau_{i-1} + w_i z_i, entry j from 0; the last one is always named; (6), (8)."""
        e = add(self.tau[i - 1][j], product(self.w[i][j], self.z[i]))
        name = self.names.component("tau", i, j + 1)
        wording = self.of("tuning function", self.experiment.unknown[j].name)
        return self.chain.let(name, e, self.tag, wording, keep=i == self.n)

    def update_law(self) -> list[Expression]:
        """theta_hat' = Gamma tau_n; (8)."""
        rates = self.adapted(self.tau[self.n])
        return [
            self.chain.let(f"{name}_dot", rate, self.tag, self.of("update law", name), keep=True)
            for name, rate in zip(self.experiment.estimates, rates, strict=True)
        ]

    def of(self, wording: str, name: str) -> str:
        """The wording, of which parameter or estimate where there are several."""
        return wording if self.p == 1 else f"{wording} of {name}"

    def adapted(self, column: Sequence[Expression]) -> list[Expression]:
        """Gamma times a column."""
        return [add(*(product(self.gain(a, b), column[b]) for b in range(self.p))) for a in range(self.p)]

    def gain(self, a: int, b: int) -> Expression:
        """Entry (a, b) of Gamma from 0, by its name."""
        return Name(self.experiment.gamma(a + 1, b + 1)) if self.experiment.Gamma[a][b] else ZERO

    def paired(self, row: Sequence[Expression], column: Sequence[Expression], scaled: bool) -> Expression:
        """A row times a column, or times Gamma times the column if it is to be scaled."""
        if scaled and self.p and self.experiment.gamma(1, 1) == "gamma":
            return product(self.gain(0, 0), self.paired(row, column, False))
        rates = self.adapted(column) if scaled else column
        return add(*(product(a, b) for a, b in zip(row, rates, strict=True)))

    def varying(self) -> list[tuple[Name, Expression]]:
        """The reference and those of its derivatives that move, each with its own derivative."""
        return [(a, b) for a, b in pairwise(self.r) if isinstance(a, Name)]

    def known_part(self, i: int, by_state: Sequence[Expression], by_reference: Sequence[Expression]) -> Expression:
        """What alpha_{i-1}' is without the parameter error and the update law; for alpha_0 = r it is r'."""
        if i == 1:
            return self.r[1]
        self.rows.append(self.row_estimate(i - 1))
        terms = [product(by_state[j - 1], self.rows[j]) for j in range(1, i)]
        terms += [product(d, rate) for d, (_, rate) in zip(by_reference, self.varying(), strict=True)]
        name = f"alpha{i - 1}"
        if placed := [p for p in self.experiment.unknown if any(p in self.in_row(j) for j in range(1, i))]:
            parameters, estimates = _listed([p.name for p in placed]), _listed([p.estimate for p in placed])
            remark = f"{name}' with {estimates} in the place of {parameters}, as if constant"
            self.chain.remarks[f"{name}_dot_known"] = remark
        return self.chain.let(f"{name}_dot_known", add(*terms), self.tag, "known part", keep=True)

    def row_estimate(self, j: int) -> Expression:
        """f_j + g_j x_{j+1} + theta_hat' phi_j: row j with the estimate in the place of theta."""
        e = add(self.f[j], product(self.g[j], self.x[j + 1]), *self.estimated(j))
        estimates = ", ".join(p.estimate for p in self.in_row(j))
        wording = f"row {j}" + (f" with {estimates}" if estimates else "")
        return self.chain.let(f"{self.experiment.states[j - 1]}_dot_known", e, self.tag, wording)

    def in_row(self, i: int) -> list[Unknown]:
        """The unknown parameters of row i."""
        return [p for p, phi in zip(self.experiment.unknown, self.phi[i], strict=True) if phi != ZERO]

    def remark_on_slopes(self, i: int) -> None:
        """Say where the derivative of a regressor is a number, which is then not seen in that of alpha_1."""
        if i == 2:
            x = self.experiment.states[0]
            for phi in self.phi[1]:
                if isinstance(phi, Name) and isinstance(rate := self.chain.rate(phi.name, x), Number):
                    e = expressions.text(self.chain.definitions[phi.name])
                    number = expressions.text(rate)
                    self.chain.remarks[f"alpha1_{x}"] = f"{phi.name}({x}) = {e} has the derivative {number}"

    # -------------------------------------------------------------- reference and plant

    def reference_statements(self) -> Iterator[Statement]:
        """r and its derivatives up to r^(n); one that is 0 is left out."""
        ordinals = ("", "first", "second", "third", "fourth")
        for order, (name, e) in enumerate(self.reference.items()):
            if order == 0 or e != ZERO:
                ordinal = ordinals[order] if order < len(ordinals) else f"{order}th"
                wording = f"its {ordinal} derivative" if order else "reference"
                yield Statement(name, e, REFERENCE, self.experiment.section or "(3)", wording)

    def plant_statements(self) -> Iterator[Statement]:
        """The rows as their author wrote them, with the true parameters, and phi where it stands there as it is."""
        true = {p.name: Name(f"{p.name}_true") for p in self.experiment.unknown}
        for i, (state, row) in enumerate(zip(self.experiment.states, self.experiment.rows, strict=True), 1):
            terms = tuple(self.with_regressor(term, i) for term in terms_of(row))
            e = Sum(terms) if isinstance(row, Sum) else terms[0]
            tag = "(7)" if self.n == 2 else "(2)"
            yield Statement(f"{state}_dot", renamed(e, true), PLANT, tag, f"plant, row {i}")

    def with_regressor(self, term: Expression, i: int) -> Expression:
        """A term of row i, with theta_j phi_ij for a parameter times what phi_ij stands for."""
        body, minus = (term.of, True) if isinstance(term, Negative) else (term, False)
        if not isinstance(body, Product):
            return term
        for j, parameter in enumerate(self.experiment.unknown):
            phi, theta = self.phi[i][j], Name(parameter.name)
            if body.factors.count(theta) == 1 and isinstance(phi, Name):
                at = body.factors.index(theta)
                rest = product(*body.factors[:at], *body.factors[at + 1 :])
                meant = self.chain.definitions[phi.name]
                if rest in (meant, negative(meant)):
                    both = Product((theta, phi) if at == 0 else (phi, theta))
                    return Negative(both) if minus != (rest != meant) else both
        return term


def renamed(e: Expression, names: Mapping[str, Expression]) -> Expression:
    """Put names in the place of names, and leave all else as it was written."""
    return expressions.rebuilt(e, lambda name: names.get(name, Name(name)))


def _derivatives(experiment: Experiment, count: int) -> list[Expression]:
    found = [experiment.reference]
    while len(found) < count:
        found.append(slope(found[-1], "t"))
    return found


def cited(tag: str) -> str:
    """The section of the lesson that a tag names, or "" where the numbers are the experiment's own."""
    return "" if tag == OWN else tag


def _last(count: int, before: int = 0) -> str:
    """The last term, or how many of the last; or those before them."""
    if before:
        return ("the term" if count == 1 else f"the {count} terms") + " before the last" + f" {before}" * (before > 1)
    return "the last term" if count == 1 else f"the last {count} terms"


def _by(names: Sequence[str]) -> str:
    """What is differentiated by, in words: x1, or x1 twice and r."""
    counts = {name: names.count(name) if len({*names}) > 1 else 1 for name in names}
    times = {1: "", 2: " twice", 3: " three times"}
    return _listed([name + times.get(count, f" {count} times") for name, count in counts.items()])


def _listed(words: Sequence[str]) -> str:
    """Words as a sentence lists them."""
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _too_large(count: str) -> str:
    return f"found a controller of {count} statements, expected at most {LARGE}; --large asks for more"


def _shortened(chain: Chain, outputs: Sequence[str]) -> dict[str, Expression]:
    """The definitions that the outputs need; one that is used once is written where it is used, unless it is kept."""
    definitions = dict(chain.definitions)
    while True:
        live = _needed(definitions, outputs)
        definitions = {name: e for name, e in definitions.items() if name in live}
        uses: dict[str, int] = {}
        for e in definitions.values():
            for name in names_in(e):
                uses[name] = uses.get(name, 0) + 1
        free = {s: e for s, e in definitions.items() if s not in chain.kept and s not in outputs}
        inlined = {s: e for s, e in free.items() if is_simple(e)}
        inlined = inlined or dict(islice(((s, e) for s, e in free.items() if uses[s] == 1 and chain.short(s, e)), 1))
        if not inlined:
            return definitions
        definitions = {s: substitute(e, inlined) for s, e in definitions.items() if s not in inlined}


def _needed(definitions: Mapping[str, Expression], outputs: Sequence[str]) -> set[str]:
    live, waiting = set[str](), [name for name in outputs if name in definitions]
    while waiting:
        name = waiting.pop()
        if name not in live:
            live.add(name)
            waiting.extend(s for s in names_in(definitions[name]) if s in definitions)
    return live
