"""The command `leafcut solve`, which studies algorithms on maps."""

from __future__ import annotations

from typing import Annotated, Any

from cyclopts import Parameter

from leafcut.cli.flags import File, switch_parameter
from leafcut.cli.progress import Reporter
from leafcut.cli.shared import (
    DONE,
    MAX_WARNINGS,
    NoDefaults,
    defaults_file_unless,
    given_options,
    print_defaults,
    print_json,
    refuse_standard_output,
    restore_dash,
)
from leafcut.cli.usage import DASH
from leafcut.errors import OptionError
from leafcut.files.whole_files import StandardInput, check_output, write_whole


def solve(
    instance: Annotated[str, Parameter(name="INSTANCE", help="a TSPLIB file, a point map, or random:200")],
    /,
    *,
    tour: Annotated[File | None, Parameter(name="--tour", help="tour file to write, in TSPLIB format")] = None,
    save_map: Annotated[
        File | None, Parameter(name="--save-map", help="table of the map's points to write (.csv), in mm")
    ] = None,
    as_json: Annotated[
        bool,
        switch_parameter(
            "--json",
            help="print the result as JSON; gap_percent refers to the best known length (optimum) if the map has one, "
            "else to lower_bound",
        ),
    ] = False,
    no_defaults: NoDefaults = False,
    options: dict[str, Any],
) -> int:
    """Find a short closed tour through the points of a map, or one point of each set, to study the algorithms."""
    from leafcut import api
    from leafcut.read.csvmap import holes_as_csv
    from leafcut.read.tsplib import tour_text
    from leafcut.report.wording import count_text, tour_quality_lines

    refuse_standard_output("--tour", tour)
    refuse_standard_output("--save-map", save_map)
    if save_map and not save_map.lower().endswith(".csv"):
        raise OptionError(f"--save-map {save_map}: a table of points is written; name a file that ends in .csv")
    for file in (tour, save_map):
        check_output(file, [instance, *([tour] if file is save_map else [])])
    with Reporter() as reporter:
        solved = api.solve(
            StandardInput.read() if restore_dash(instance) == DASH else instance,
            progress=reporter,
            defaults_file=defaults_file_unless(no_defaults),
            **given_options(options),
        )
    part, solution = solved.part, solved.solution
    if tour:
        write_whole(tour, tour_text(part.name, solution.nodes, every=part.grouping is None))
    if save_map:
        write_whole(save_map, holes_as_csv(part))
    if as_json:
        from leafcut.report.json_answer import tour_as_json

        print_json(tour_as_json(solved))
        return DONE
    sets = "" if part.grouping is None else f" in {count_text(part.grouping.n_clusters, 'set')}"
    print(f"{part.name}: {count_text(len(part.holes), 'point')}{sets}, {solution.algorithm}, seed {solution.seed}")
    print(f"length {solution.cost:,.10g}, {count_text(solution.iterations, 'iteration')} in {solution.seconds:.2f} s")
    if solution.stopped_early and options.get("time_limit") is None:
        print("stopped early; this is the best tour so far")
    for line in tour_quality_lines(solution.cost, part.optimum, solution.lower_bound):
        print(line)
    print_defaults(solved.defaults)
    for issue in part.issues[:MAX_WARNINGS]:
        print(f"{issue.code}  {issue.message}{f' ({issue.place})' if issue.place else ''}")
    return DONE
