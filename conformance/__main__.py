# SPDX-License-Identifier: MIT
"""The command line: python -m conformance --help."""

import argparse
import csv
import os
import re
import signal
import sys
import warnings
from collections.abc import Iterator
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from conformance.atomic import check_output, withdraw, write_atomically, write_output
from conformance.foreign import plain, regular, shown
from conformance.places import IN_A_CLONE
from conformance.theory.numbers import EXACT, exact_number

if TYPE_CHECKING:
    from conformance.theory.experiments import Experiment

GREEN = r"holds(?=:)|(?<=  )pass(?=  )|conforms$"
RED = r"FAILS(?=:)|(?<=  )(fail|error|missing|stale)(?=  )|does not conform(?=$|:)"
LARGE = "even if the design has more statements than anyone reads"
PLANT = "the experiment: a file such as plants/problem_1c.toml (default: the lesson's)"
MOST_ROWS = 1_000_000  # that truth prints
MESSAGE = 1000  # characters of an error
ANYWHERE = ("certify", "checks", "design", "diff", "truth", "validate")  # what needs no clone of the repository


def exact(text: str) -> Fraction:
    """A number that is what it says: 0.1 is 1/10."""
    try:
        return exact_number(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def exact_times(text: str) -> list[Fraction]:
    """Comma-separated times."""
    return [exact(part) for part in text.split(",")]


def positive(text: str) -> Fraction:
    """A positive exact number."""
    value = exact(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected a positive number")
    return value


def whole_number(text: str) -> int:
    """A whole number, of at most 18 digits."""
    if not re.fullmatch(r"[-+]?[0-9]{1,18}", text):
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected a whole number")
    return int(text)


def positive_count(text: str) -> int:
    """A positive whole number."""
    if not re.fullmatch(r"0*[1-9][0-9]{0,8}", text):
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected a positive whole number")
    return int(text)


def digit_count(text: str) -> int:
    """A number of significant digits."""
    if not re.fullmatch(r"[0-9]{1,3}", text) or not 1 <= int(text) <= 100:
        raise argparse.ArgumentTypeError(f"found {shown(text)}, expected a whole number from 1 to 100")
    return int(text)


def show(text: str) -> None:
    """Print; on a terminal, what holds in green and what fails in red, unless NO_COLOR is set.

    What does not print is escaped, wherever it comes from; line ends are ours.
    """
    text = "\n".join(plain(line, sys.maxsize) for line in text.split("\n"))
    if sys.stdout.isatty() and not os.environ.get("NO_COLOR"):
        for pattern, colour in ((RED, 31), (GREEN, 32)):
            text = re.sub(pattern, rf"\033[{colour}m\g<0>\033[0m", text, flags=re.MULTILINE)
    print(text)


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {plain(message, MESSAGE)}; see {self.prog} --help\n")


def parser() -> Parser:
    """The commands and their options."""
    top = Parser(prog="conformance", description="Judge the six programs of Chapter 17, Lesson 1.")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    table = commands.add_parser(
        "table", help="what ran, on which engine, and what came out (the ports of PORTS, or all)"
    )
    table.add_argument("--plant", type=Path, metavar="FILE.toml", help="of the programs written for this plant")
    report = commands.add_parser(
        "report",
        help="write the page on what the programs left, one self-contained file",
        description="Write the page, and beside the lesson's the index of all plants, report/plants.html.",
    )
    report.add_argument("--plant", type=Path, metavar="FILE.toml", help="of the programs written for this plant")
    report.add_argument(
        "--since", type=Path, metavar="EARLIER.json", help="say what changed since this result, as diff does"
    )
    report.add_argument(
        "--to",
        type=Path,
        metavar="FILE.html",
        help="where (default: report/index.html in build/ or build/<name>/)",
    )
    commands.add_parser(
        "readme", help="bring the README's table and pictures up to date; that of the page where there is a Chromium"
    )
    check = commands.add_parser("check", help="judge what the programs left")
    check.add_argument(
        "--plant", nargs="+", type=Path, metavar="FILE.toml", help="those that make wrote for these plants"
    )
    checks = commands.add_parser("checks", help="list every check: its id, which is stable, and what it means")
    commands.add_parser("tolerances", help="write docs/tolerances.md: what each port is held to, and why")
    validate = commands.add_parser(
        "validate",
        help="judge anyone's CSV",
        description="Judge a CSV that anyone made, in any language. The exit status is 0 where it conforms, 1 where it "
        "does not, 2 where it cannot be judged.",
    )
    validate.add_argument(
        "csv",
        type=Path,
        metavar="FILE.csv",
        help="columns t,x1,x2,theta_hat,reference,tracking_error; of another plant, its own states and estimates",
    )
    validate.add_argument("--stdout", type=Path, metavar="FILE", help="what the program printed, judged too")
    validate.add_argument(
        "--json", type=Path, metavar="FILE", help="write the verdict there as JSON (-: to standard output alone)"
    )
    variants = commands.add_parser(
        "variants",
        help="run edited programs: experiments that must conform, mistakes that must be refused",
        description="Run and judge the variants of conformance/trials/variants/. The exit status is 1 where an "
        "experiment does not conform, or a mistake is not refused by its check.",
    )
    variants.add_argument("names", nargs="*", metavar="NAME", help="these alone (default: all)")
    variants.add_argument("--list", action="store_true", help="only list them")
    commands.add_parser("exercises", help="write docs/exercises.md: each variant as a diff in every language")
    mutants = commands.add_parser(
        "mutants",
        help="change each operator and number of the programs in turn: does a check notice?",
        description="Make, run and judge every mutant of the programs: some minutes, resumed where interrupted. The "
        "exit status is 1 where one survives without a stated reason.",
    )
    what = mutants.add_mutually_exclusive_group()
    what.add_argument("--list", action="store_true", help="only list them")
    what.add_argument("--plant", type=Path, metavar="FILE.toml", help="of the programs written for this plant")
    diff = commands.add_parser("diff", help="what changed between two results; the exit status is 1 where anything did")
    diff.add_argument("old", type=Path, metavar="OLD.json")
    diff.add_argument("new", type=Path, metavar="NEW.json")
    design = commands.add_parser(
        "design",
        help="derive the adaptive controller of a plant, and prove it",
        description="Print the derivation for an experiment file such as plants/Chapter17_Lesson1.toml: the plant in "
        "strict-feedback form, each step, the Lyapunov function, and the outcome of the proof. The exit status is 0 "
        "where the proof holds, 1 where it does not, 2 where there is no design; every reason is shown at its place.",
    )
    design.add_argument("file", type=Path, metavar="FILE.toml", help="the experiment")
    design.add_argument("--format", choices=("text", "markdown", "latex", "json"), default="text", help="default: text")
    design.add_argument("--large", action="store_true", help=LARGE)
    write = commands.add_parser(
        "write",
        help="write the programs of a plant, to take away",
        description="Write the program of an experiment file in every language, with what it needs to run. Each goes "
        "to the folder of its language below FOLDER; files that say another thing are kept, unless --force.",
    )
    write.add_argument("file", type=Path, metavar="FILE.toml", help="the experiment")
    write.add_argument("--to", type=Path, required=True, metavar="FOLDER", help="where")
    write.add_argument("--ports", nargs="+", metavar="PORT", help="these alone (default: all)")
    write.add_argument("--force", action="store_true", help="overwrite what is there")
    new_port = commands.add_parser("new-port", help="write the skeleton of a port in another language")
    new_port.add_argument("name", help="lower-case letters and digits, such as fortran")
    stages = commands.add_parser("port", help="say stage by stage how far a port has come, and what to do next")
    stages.add_argument("name", help="of the port: its folder's")
    truth = commands.add_parser(
        "truth",
        help="the exact solution, as proven balls",
        description="Print the proven enclosure of the exact solution as CSV: t, then for each state, estimate and "
        "error z, and V, a value and its radius, which covers the rounding of the print too.",
    )
    when = truth.add_mutually_exclusive_group()
    when.add_argument("--times", type=exact_times, metavar="T,T,...", help=f"times in s, each {EXACT}")
    when.add_argument("--step", type=positive, default=Fraction(1, 10), help="every so many s (default: 0.1)")
    when.add_argument("--certificate", type=Path, metavar="FILE", help="write the proof there, for certify, instead")
    truth.add_argument("--digits", type=digit_count, default=20, help="significant digits printed (default: 20)")
    certify = commands.add_parser(
        "certify",
        help="check a certificate of the exact solution by a second way",
        description="Check a proof that conformance truth --certificate wrote, by another way than it was found. The "
        "exit status is 0 where it holds, 1 where it does not, 2 where the file is no certificate.",
    )
    certify.add_argument("certificate", type=Path, metavar="FILE")
    of = "derive the closed loop of this experiment too: is it what was solved?"
    certify.add_argument("--plant", type=Path, metavar="FILE.toml", help=of)
    certify.add_argument("--large", action="store_true", help=LARGE)
    random = commands.add_parser(
        "campaign",
        help="random scenarios, every program on each",
        description="Draw scenarios, run every program on each, and judge each run against the scenario's own proven "
        "solution. What is done is kept and not done again. The exit status is 0 where every run conforms, 1 where one "
        "does not, 2 where the campaign cannot be run.",
        epilog="docs/campaign.md tells what is drawn, and from which ranges.",
    )
    random.add_argument("--count", type=positive_count, default=10, help="scenarios, or plants (default: 10)")
    which = random.add_mutually_exclusive_group()
    which.add_argument("--seed", type=whole_number, default=0, help="of the draw (default: 0)")
    which.add_argument(
        "--own",
        action="store_true",
        help="per program its own: drawn by its source, and those that reach furthest taken",
    )
    random.add_argument(
        "--plants",
        action="store_true",
        help="random plants with up to four states: each is written in every language, and judged by its own proof",
    )
    random.add_argument(
        "--jobs", type=positive_count, default=os.cpu_count(), help="runs at a time here (default: one per core)"
    )
    random.add_argument("--scheduler", metavar="ADDRESS", help="use this Dask cluster, such as tcp://host:8786")
    random.add_argument("--folder", type=Path, help="where results are kept (default: build/campaign)")
    for each in (check, variants, mutants, random):
        each.add_argument("--ports", nargs="+", metavar="PORT", help="these alone (default: those of PORTS, or all)")
    for each in (validate, truth, checks):
        each.add_argument("--plant", type=Path, metavar="FILE.toml", help=PLANT)
        each.add_argument("--large", action="store_true", help=LARGE)
    return top


def main() -> int:
    """Run one command; returns the exit status.

    Whatever goes wrong is one line and status 2. Who reads the output may leave: then we end as other tools do.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # what a terminal cannot show changes no verdict
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    top = parser()
    arguments = top.parse_args()
    if not IN_A_CLONE and arguments.command not in ANYWHERE:
        top.error(
            f"{arguments.command}: this needs a clone of the repository, and conformance is installed without one"
        )
    try:
        status = COMMANDS[arguments.command](arguments)
        if sys.stdout is not None:
            sys.stdout.flush()
        return status
    except BrokenPipeError:
        signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGPIPE)
        return 128 + signal.SIGPIPE
    except KeyboardInterrupt:
        top.exit(130, f"{top.prog}: {arguments.command}: interrupted; what is done is kept\n")
    except Exception as error:
        drop_output()
        if type(error).__name__ == "FileFault":  # as a compiler shows it
            print(error, file=sys.stderr)
            return 2
        top.error(f"{arguments.command}: {said(error)}")


def said(error: Exception) -> str:
    """An error in words; one that was not foreseen with its kind and place."""
    if isinstance(error, OSError) and error.strerror:
        return f"{plain(error.filename)}: {error.strerror}" if error.filename else error.strerror
    if type(error) is ValueError or (isinstance(error, ValueError) and "conformance" in type(error).__module__):
        return str(error)
    if any(kind.__name__ == "ProofEnded" for kind in type(error).__mro__):
        return f"the exact solution of this experiment is out of reach: {error}"
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = f"{Path(trace.tb_frame.f_code.co_filename).name}, line {trace.tb_lineno}" if trace is not None else "?"
    return f"found a case that was not foreseen, please report it: {type(error).__name__} in {place}: {error}"


def drop_output() -> None:
    """Let go of output that cannot be written, so that the interpreter does not complain of it at its end."""
    try:
        sys.stdout.flush()
    except (AttributeError, OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def print_table(arguments: argparse.Namespace) -> int:
    """What ran and what came out."""
    from conformance.programs.ports import read_ports, selected_ports
    from conformance.programs.table import boxes, table

    plant = ""
    if arguments.plant:
        from conformance.theory.experiment_file import read_experiment

        plant = read_experiment(arguments.plant).name
    ports = selected_ports(plant=plant)
    lacking = [port.name for port in read_ports().values() if plant and not port.template]
    print(table(ports.values(), lacking), boxes(ports.values()), sep="\n")
    return 0


def check(arguments: argparse.Namespace) -> int:
    """The verdicts on the programs, as a table; 0 where all conform."""
    if arguments.plant:
        from conformance.judging.gallery import judge_plants, told

        judged = judge_plants(arguments.plant, arguments.ports, os.cpu_count() or 1)
        show(told(judged))
        return 0 if all(one.conforms for one in judged) else 1
    from conformance.judging.verdict import judge_all, summary, write_result
    from conformance.programs.ports import ROOT, selected_ports
    from conformance.theory.lesson import LESSON
    from conformance.trials.coverage import with_own_experiments

    withdraw(ROOT / "build" / "result.json")
    ports = selected_ports(arguments.ports)
    judgement = with_own_experiments(judge_all(ports, LESSON), ports)
    write_result(judgement)
    show(summary(judgement))
    return 0 if judgement.conforms else 1


def print_checks(arguments: argparse.Namespace) -> int:
    """Every check's id and meaning."""
    from conformance.judging.verdict import list_of_checks

    print(list_of_checks(experiment_asked(arguments)))
    return 0


def write_tolerances(arguments: argparse.Namespace) -> int:
    """docs/tolerances.md."""
    from conformance.pages.tolerances import PAGE, page

    write_atomically(PAGE, page())
    print(PAGE)
    return 0


def experiment_asked(arguments: argparse.Namespace) -> "Experiment":
    """What --plant names, or the lesson's; raises FileFault or TooLarge."""
    if arguments.plant is None:
        from conformance.theory.lesson import LESSON

        return LESSON
    from conformance.theory.experiment_file import read_experiment
    from conformance.theory.statements import statements_of

    experiment = read_experiment(arguments.plant)
    statements_of(experiment, arguments.large)
    return experiment


def validate(arguments: argparse.Namespace) -> int:
    """The verdict on a file: what does not hold, its first cause before all; then what holds, with every figure."""
    if arguments.json:
        check_output(arguments.json, arguments.csv, arguments.stdout, arguments.plant)
        withdraw(arguments.json)
    for path in filter(None, (arguments.csv, arguments.stdout)):
        regular(path)
    experiment = experiment_asked(arguments)

    from conformance.judging.verdict import judge_file, to_json  # which takes a while
    from conformance.truth.progress import bar

    with bar(float(experiment.horizon)) as progress:
        verdict = judge_file(arguments.csv, experiment, arguments.stdout, diagnose=True, progress=progress)
    if arguments.json:
        write_output(arguments.json, to_json([verdict]))
    holds = [str(result) for result in verdict.results if result.passed]
    notes = [f"note: {note}" for note in verdict.notes]
    failed = f"{verdict.name} does not conform: {verdict.reason.removeprefix(verdict.name + ', ')}"
    lines = [*holds, *notes, f"{verdict.name} conforms"] if verdict.conforms else [failed, *notes, *holds]
    if str(arguments.json) != "-":
        show("\n".join(lines))
    return 0 if verdict.conforms else 1


def report(arguments: argparse.Namespace) -> int:
    """The page, and the index of all plants where it leads to one."""
    from conformance.judging.difference import read_result
    from conformance.judging.verdict import judge_all
    from conformance.pages.report.evidence import changed
    from conformance.pages.report.gallery import GALLERY, publish
    from conformance.pages.report.page import page, page_of
    from conformance.programs.ports import selected_ports
    from conformance.theory.experiment_file import read_experiment
    from conformance.theory.lesson import LESSON

    experiment = read_experiment(arguments.plant) if arguments.plant else LESSON
    path = arguments.to or page_of(experiment)
    check_output(path, arguments.since)
    earlier = arguments.since and read_result(arguments.since)
    ports = selected_ports(plant=experiment.name if arguments.plant else "")
    judgement = judge_all(ports, experiment)
    changes = changed(arguments.since.name, earlier, judgement) if earlier else None
    if arguments.to:
        write_output(path, page(ports, judgement, experiment, changes))
    else:
        publish(ports, judgement, experiment, changes)
    if str(path) != "-":
        index = "" if arguments.to else f"; all plants: {plain(GALLERY, MESSAGE)}"
        print(f"the page is {plain(path, MESSAGE)}, {path.stat().st_size / 1e6:.1f} MB{index}")
    return 0


def readme(arguments: argparse.Namespace) -> int:
    """The README's table and pictures."""
    from conformance.judging.verdict import judge_all
    from conformance.pages.readme import write_readme
    from conformance.programs.ports import the_six
    from conformance.theory.lesson import LESSON

    if not write_readme(judge_all(the_six(), LESSON), the_six()):
        print("docs/page.png is as it was: no Chromium is found; Debian's package is chromium")
    return 0


def diff(arguments: argparse.Namespace) -> int:
    """What changed between two results."""
    from conformance.judging.difference import differences, read_result

    lines = differences(read_result(arguments.old), read_result(arguments.new))
    print("\n".join(lines or ["nothing changed"]))
    return 1 if lines else 0


def variants(arguments: argparse.Namespace) -> int:
    """Edited programs, run and judged."""
    from conformance.programs.ports import ROOT, selected_ports
    from conformance.trials import kill_matrix
    from conformance.trials.variant import read_variants, runnable

    known = read_variants()
    unknown = [name for name in arguments.names if name not in known]
    if unknown:
        raise ValueError(f"found {plain(' '.join(unknown))}, expected of {' '.join(known)}")
    asked = [variant for name, variant in known.items() if name in (arguments.names or known)]
    if arguments.list:
        print("\n".join(f"{variant.name}: {variant.title}" for variant in asked))
        return 0
    ports = runnable(selected_ports(arguments.ports).values())
    kill_matrix.prepare(asked, ports)
    found = kill_matrix.outcomes(asked, ports)
    write_atomically(ROOT / "build" / "kill-matrix.json", kill_matrix.to_json(found))
    print(kill_matrix.table(found))
    return 0 if found and all(outcome.as_wanted for outcome in found) else 1


def exercises(arguments: argparse.Namespace) -> int:
    """The page of exercises, written."""
    from conformance.pages.exercises import PAGE, page
    from conformance.programs.ports import the_six
    from conformance.trials import kill_matrix
    from conformance.trials.variant import read_variants

    known, ports = read_variants().values(), list(the_six().values())
    kill_matrix.prepare(known, ports)
    write_atomically(PAGE, page(known, ports, kill_matrix.outcomes(known, ports)))
    print(PAGE)
    return 0


def mutants(arguments: argparse.Namespace) -> int:
    """Mutants, run and judged."""
    from conformance.programs.ports import selected_ports
    from conformance.trials import mutants
    from conformance.trials.variant import runnable

    ports = runnable(selected_ports(arguments.ports).values())
    if arguments.plant:
        from conformance.theory.experiment_file import read_experiment

        found = mutants.fates_of_plant(read_experiment(arguments.plant), [port for port in ports if port.template])
    else:
        made = [mutant for port in ports for mutant in mutants.mutants(port)]
        if arguments.list:
            print("\n".join(mutant.name for mutant in made))
            return 0
        found = mutants.fates(made)
    print(mutants.summary(found))
    return 0 if found and not mutants.unexplained(found) else 1


def new_port(arguments: argparse.Namespace) -> int:
    """The skeleton of a port."""
    from conformance.programs.new_port import write_skeleton

    print("\n".join(str(path) for path in write_skeleton(arguments.name)))
    print(f"next, as docs/porting.md says: .venv/bin/conformance port {arguments.name}")
    return 0


def design(arguments: argparse.Namespace) -> int:
    """The derivation of a design; 0 where its identity holds."""
    from conformance.theory.derivation import FORMATS, derivation
    from conformance.theory.experiment_file import read_experiment

    experiment = read_experiment(arguments.file)
    derived = derivation(experiment, arguments.large)
    print(FORMATS[arguments.format](derived), end="")
    return 0 if derived.holds else 1


def port(arguments: argparse.Namespace) -> int:
    """How far a port has come; 0 where every stage holds."""
    from conformance.programs.ports import selected_ports
    from conformance.trials.guide import guide

    (asked,) = selected_ports([arguments.name]).values()
    done = True
    for holds, text in guide(asked):
        print(text, flush=True)
        done = done and holds
    if done:
        print(f"every stage holds; last: make check PORTS={asked.name}")
    return 0 if done else 1


def write(arguments: argparse.Namespace) -> int:
    """The programs of an experiment."""
    from conformance.programs.ports import read_ports, selected_ports
    from conformance.programs.writer import write_programs
    from conformance.theory.experiment_file import read_experiment

    ports = selected_ports(arguments.ports) if arguments.ports else read_ports()
    ports = {name: port for name, port in ports.items() if port.template or arguments.ports}
    experiment = read_experiment(arguments.file)
    for path in write_programs(experiment, ports.values(), arguments.to, arguments.force):
        print(plain(path, MESSAGE))
    return 0


def print_truth(arguments: argparse.Namespace) -> int:
    """The enclosure at the times asked for, row by row; or its certificate."""
    experiment = experiment_asked(arguments)
    if arguments.certificate:
        from conformance.truth.certificate import certificate
        from conformance.truth.experiment import problem, truth
        from conformance.truth.progress import bar

        with bar(float(experiment.horizon)) as progress:
            enclosed = truth(experiment, progress=progress)
        write_atomically(arguments.certificate, certificate(problem(experiment), enclosed))
        print(f"next: conformance certify {arguments.certificate}")
        return 0
    count = int(experiment.horizon / arguments.step) + 1
    if not arguments.times and count > MOST_ROWS:
        raise ValueError(f"found a step that makes {plain(count, 40)} rows, expected at most {MOST_ROWS}")
    for time in arguments.times or ():
        if not 0 <= time <= experiment.horizon:
            raise ValueError(f"time {plain(time, 40)} is outside of [0, {plain(experiment.horizon, 40)}]")

    from conformance.truth.experiment import truth_table  # which takes a while
    from conformance.truth.progress import bar

    def every_step() -> Iterator[Fraction]:
        return (i * arguments.step for i in range(count))

    with bar(float(experiment.horizon)) as progress:
        rows = truth_table(experiment, arguments.times or every_step(), arguments.digits, progress)
        header = next(rows)
    csv.writer(sys.stdout, lineterminator="\n").writerows(chain([header], rows))
    return 0


def up(value: float) -> str:
    """With two digits, rounded up."""
    from decimal import ROUND_UP, Context, Decimal

    return f"{Context(prec=2, rounding=ROUND_UP).plus(Decimal(value)):.1e}"


def check_certificate(arguments: argparse.Namespace) -> int:
    """What a certificate claims, and whether it holds."""
    from conformance.truth.certify import NotProven, certify, read

    found, name = read(arguments.certificate), arguments.certificate.name
    if arguments.plant:
        from conformance.truth.certificate import same_problem  # which needs SymPy
        from conformance.truth.experiment import problem

        if not same_problem(problem(experiment_asked(arguments)), found):
            show(f"{name} FAILS: it is of another problem than {arguments.plant}")
            return 1
    try:
        proven = max(float(bound) for step in certify(found) for bound in step)
    except NotProven as reason:
        show(f"{name} FAILS: {reason}")
        return 1
    stated = max(float(radius) for step in found.steps for radius in step.radius)
    claim = f"{', '.join(found.names)} on [0, {found.horizon}] lie within the stated radii, at most {up(stated)}"
    show(f"{name} holds: {claim}; this way, within {up(proven)}")
    return 0


def campaign(arguments: argparse.Namespace) -> int:
    """The outcomes of a campaign, counted; what failed comes with the experiment that reproduces it."""
    from tqdm import tqdm

    from conformance.programs.ports import selected_ports

    if arguments.plants:
        from conformance.trials import random_plants

        chosen = list(selected_ports(arguments.ports, plant="random"))
        jobs = arguments.jobs or os.cpu_count() or 1
        drawn = random_plants.run_plants(arguments.seed, arguments.count, chosen, jobs)
        found = list(tqdm(drawn, total=arguments.count, unit="plant", disable=None))
        print(random_plants.report(found, chosen))
        return 0 if all(one.conforms for one in found) else 1
    from conformance.trials.campaign import FOLDER, draw, prepare_all, report, run_campaign, trial
    from conformance.trials.coverage import own_experiments

    ports = selected_ports(names=arguments.ports)
    folder = (arguments.folder or FOLDER).resolve()
    programs = prepare_all(ports.values())
    if arguments.own:
        trials = [trial(one, each, folder) for each in programs for one in own_experiments(each.port, arguments.count)]
    else:
        experiments = [draw(arguments.seed, number) for number in range(arguments.count)]
        trials = [trial(experiment, program, folder) for experiment in experiments for program in programs]
    outcomes = run_campaign(trials, arguments.scheduler, arguments.jobs or os.cpu_count() or 1)
    done = list(tqdm(outcomes, total=len(trials), unit="run", disable=None))
    print(report(done, folder))
    return 0 if all(outcome.status == "pass" for outcome in done) else 1


COMMANDS = {
    "campaign": campaign,
    "table": print_table,
    "check": check,
    "checks": print_checks,
    "report": report,
    "readme": readme,
    "tolerances": write_tolerances,
    "validate": validate,
    "variants": variants,
    "exercises": exercises,
    "mutants": mutants,
    "diff": diff,
    "design": design,
    "write": write,
    "new-port": new_port,
    "port": port,
    "truth": print_truth,
    "certify": check_certificate,
}


if __name__ == "__main__":
    sys.exit(main())
