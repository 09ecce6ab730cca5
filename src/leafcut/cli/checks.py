"""The commands that check a program: simulate, verify and stock."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from leafcut.cli.flags import File, Json, Name, switch_parameter
from leafcut.cli.several import expand_inputs
from leafcut.cli.shared import (
    DONE,
    REFUSED,
    DialectOption,
    NoDefaults,
    defaults_file_unless,
    given_options,
    note_unchanged_output,
    print_defaults,
    print_json,
    process_each_input,
    refuse_standard_output,
    restore_dash,
)
from leafcut.cli.usage import DASH, refuse_standard_input
from leafcut.errors import OptionError, count_of
from leafcut.files.whole_files import StandardInput, check_output, write_bytes
from leafcut.units import format_length, format_time, to_fixed

if TYPE_CHECKING:
    from leafcut.model.simulation import Simulation


def simulate(
    *programs: Annotated[
        str,
        Parameter(name="PROGRAM", help="one or more G-code programs, or a pattern with * and ?; - for standard input"),
    ],
    dialect: DialectOption = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Show the machine time and travel of a program, and any dangerous moves."""
    from leafcut import api
    from leafcut.report.json_answer import simulation_as_json

    inputs, each = expand_inputs([*map(restore_dash, programs)], "simulate")
    given = {"dialect": dialect, "defaults_file": defaults_file_unless(no_defaults), **given_options(options)}

    def simulate_program(program: str) -> tuple[Simulation, int]:
        simulation = api.simulate(StandardInput.read() if program == DASH else program, **given)
        dangerous = any(issue.severity == "danger" for issue in simulation.issues)
        return simulation, REFUSED if dangerous and options.get("strict") else DONE

    def answer_for(_: int, program: str) -> tuple[dict[str, Any], int]:
        simulation, status = simulate_program(program)
        return simulation_as_json(simulation), status

    if each:
        rows, status = process_each_input("program", inputs, answer_for)
        if as_json:
            from leafcut.report.several import batch_as_json

            print_json(batch_as_json(rows, status))
        else:
            from rich.console import Console

            from leafcut.report.several import print_simulations

            print_simulations(rows, Console())
        return status
    simulation, status = simulate_program(inputs[0])
    if as_json:
        print_json(simulation_as_json(simulation))
    else:
        _print_simulation(simulation)
    return status


def _print_simulation(simulation: Simulation) -> None:
    from leafcut.report.chart import names_of_time_kinds
    from leafcut.report.set_up import axis_ranges

    dangers = [issue for issue in simulation.issues if issue.severity == "danger"]
    for issue in dangers:
        print(f"danger: {issue}")
    cost = simulation.measure
    print(f"{simulation.program}: {format_time(cost.time_s)} on {simulation.machine.name}")
    print(f"rapid {format_length(cost.travel_mm)}, feed {format_length(cost.cut_mm)}")
    names = names_of_time_kinds(simulation.machine.head.method)
    print("  ".join(f"{names[kind]} {format_time(s)}" for kind, s in cost.by_kind.items() if s > 0.0))
    for tool, seconds in cost.by_tool.items():
        print(f"T{tool} {format_time(seconds)}")
    for axis, low, high in axis_ranges(simulation.path):
        print(f"{axis} {to_fixed(low, 3)} to {to_fixed(high, 3)} mm")
    if not any(issue.code.startswith("L8") for issue in simulation.issues):
        print("no dangerous moves found")
    for issue in simulation.issues:
        if issue not in dangers:
            print(f"{issue.severity}: {issue}")
    print_defaults(simulation.defaults)


def stock(
    program: Annotated[str, Parameter(name="PROGRAM", help="a G-code program; - for standard input")],
    /,
    *more: Annotated[str, Parameter(show=False)],
    output: Annotated[
        File | None,
        Parameter(
            name=["--output", "-o"],
            help="file to write with the remaining stock: a picture (.png), or a solid for other programs (.stl)",
        ),
    ] = None,
    same_as: Annotated[
        File | None,
        Parameter(
            name="--same-as",
            help="another program that must leave the same stock; if it does not, the exit status is 1",
        ),
    ] = None,
    dialect: DialectOption = None,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Show what a program cuts from its stock: volume, depth, air-cutting time, collisions of rapids and holders."""
    from leafcut import api
    from leafcut.report.stock_report import check_stock_extension, print_stock, stock_as_json, stock_file_data

    if more:
        raise OptionError(f"stock takes one program, not {1 + len(more)}; run them one by one")
    program = restore_dash(program)
    refuse_standard_input("--same-as", same_as)
    refuse_standard_output("-o", output)
    check_stock_extension(output)
    check_output(
        output, [program if program != DASH else None, same_as, options.get("tools"), options.get("workpiece")]
    )
    source = StandardInput.read() if program == DASH else program
    with note_unchanged_output(output):
        result = api.stock(
            source,
            same_as=same_as,
            dialect=dialect,
            defaults_file=defaults_file_unless(no_defaults),
            **given_options(options),
        )
    if output:
        write_bytes(output, stock_file_data(result, output))
    if as_json:
        print_json(stock_as_json(result, output))
    else:
        from rich.console import Console

        print_stock(result, output, Console())
        print_defaults(result.defaults)
    dangers = bool(result.rapids or result.collisions)
    return REFUSED if result.differences or (dangers and options.get("strict")) else DONE


def verify(
    original: Annotated[str, Parameter(name="ORIGINAL", help="the reference program")],
    new: Annotated[str, Parameter(name="NEW", help="the program to compare with the reference program")],
    /,
    *more: Annotated[str, Parameter(show=False)],
    dialect: Annotated[
        Name | None,
        Parameter(name="--dialect", help="dialect of both programs, by name or TOML file (default: the machine's)"),
    ] = None,
    allow_reverse: Annotated[
        bool,
        switch_parameter(
            "--allow-reverse",
            help="accept open cuts of constant depth in the opposite direction",
        ),
    ] = False,
    no_defaults: NoDefaults = False,
    as_json: Json = False,
    options: dict[str, Any],
) -> int:
    """Check that two programs do the same work, to 0.002 mm, or show where they differ."""
    from leafcut import api

    if more:
        raise OptionError(
            f"verify compares two programs, but {len(more) + 2} were given; give the original and the new one"
        )
    if restore_dash(original) == restore_dash(new) == DASH:
        raise OptionError("verify: only one of the two programs can come from standard input")
    reference, candidate = (StandardInput.read() if restore_dash(word) == DASH else word for word in (original, new))
    proof = api.verify(
        reference,
        candidate,
        dialect=dialect,
        allow_reverse=allow_reverse,
        defaults_file=defaults_file_unless(no_defaults),
        **given_options(options),
    )
    if as_json:
        from leafcut.report.json_answer import verification_as_json

        print_json(verification_as_json(proof))
    else:
        n_reversed = proof.reversed_cuts
        if proof.same:
            print("the same work" + (f", {count_of(n_reversed, 'cut')} reversed" if n_reversed else ""))
        else:
            print("not the same work")
        for difference in proof.differences:
            print(difference)
        for note in proof.notes:
            print(f"note: {note}")
    return DONE if proof.same else REFUSED
