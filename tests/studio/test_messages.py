"""What leafcut says is said in Spanish on a Spanish page: by lines with gaps, which are those of the source."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

import pytest
from said_lines import GAP, Source, said, source_of

from leafcut import errors
from leafcut.processes.program.plan.sections import find_sections, program_rows
from leafcut.studio.messages import Messages
from leafcut.studio.wording import words

ROOT = Path(__file__).parents[2] / "src" / "leafcut"
ES = words("es")
#: What refuses, and which of its arguments says why.
ERRORS = {
    **{name: (0,) for name in dir(errors) if name.endswith("Error")},
    **dict.fromkeys(("OutputError", "BlockError", "UnclearBlock", "NesterError"), (0,)),
    **dict.fromkeys(("_Ended", "_Alarmed", "_Silent", "PortLost"), (0,)),  # of a program that is sent
    "ReadError": (1,),
    "parsing": (1,),
}
#: Refusals that nobody meets in the studio, and why.
ELSEWHERE = {
    "cli.py": "the command line's own inputs and outputs",
    "several.py": "several files in one command line",
    "batch.py": "the command `batch` alone",
    "report/stock_report.py": "the command `stock` alone",
    "cli_machine.py": "the commands `machine` and `tools` alone",
    "read/time_table.py": "the command `machine check` alone",
    "read/tool_text.py": "the command `tools import` alone",
    **dict.fromkeys(
        (f"read/controllers/{name}.py" for name in ("importing", "questions", "ini_text", "mach", "fluidnc")),
        "the command `machine` alone",
    ),
    "processes/cutting_data/run.py": "the command `cutting-data` alone",
    "processes/cutting_data/drawn_work.py": "the command `cutting-data` alone",
    "processes/cutting_data/limits.py": "the command `cutting-data` alone",
    "processes/cutting_data/saving.py": "the command `cutting-data` alone",
    "report/front_chart.py": "the command `cutting-data` alone",
    "read/work_materials.py": "the command `cutting-data` alone",
    "cli_send.py": "the command `send` alone",
    "addons/__init__.py": "the command `addon` alone",
    "cli_inside.py": "the commands `filter`, `watch`, `defaults` and `addon` alone",
    "linuxcnc_filter.py": "the command `filter` alone",
    "shop_defaults.py": "the command `defaults` alone",
    "watch_folder.py": "the command `watch` alone",
    "executors.py": "`--executor` of the command line",
    "cli_lab.py": "the command `lab` alone",
    "lab/description.py": "the command `lab` alone",
    "lab/description_table.py": "the command `lab` alone",
    "lab/judging.py": "the command `lab` alone",
    "lab/loading.py": "the command `lab` alone",
    "lab/page.py": "the command `lab` alone",
    "lab/statistics.py": "the command `lab` alone",
    "lab/tuning.py": "the command `lab` alone",
    "studio/server/app.py": "the studio does not start",
}
#: Lines that are made of others, each of which is looked up where it is made.
MADE_OF_OTHERS = {
    "--baud {}: {}",
    "the {} '{}' is a {}",
    "the reader '{}' is a {}",
    "{} is active is not known",
    "{} on {}: {}",
    "--workpiece {}: {}",
    "{} on {}: {} ({} times)",
    "{}: {} {}{}, {} mm² in all are cut off for a tool of {} mm",
    "{}: {} {}{}, {} mm² in all, cannot be reached by a tool of {} mm; the largest, {} mm² near ({}, {})",
}
#: Words that no Spanish line has, but in quotes, in flags and their values, and in what is typed as it stands.
ENGLISH = re.compile(
    r"(?<![\w'/-])(?:the|of|is|are|and|with|without|cannot|must|has|have|it|its|or|for|than|not|leave|give|choose|an|be"
    r"|by|to|in|at|on|this|that|was|more|only|from|which|before|after|near|needs)(?![\w'/-])"
)
TYPED = re.compile(r"(?<!\w)'[^']*'|--[a-z-]+(?: on\b| off\b)?|mm o in\b")


def files(*rooms: str) -> list[Path]:
    """Return the files of some rooms of the source; of all where none is named."""
    found = [ROOT / room for room in rooms] or [ROOT]
    return sorted(file for room in found for file in ([room] if room.is_file() else room.rglob("*.py")))


def unknown(lines: Mapping[str, Path], form: str = GAP) -> dict[str, str]:
    """Return the lines that are not said in Spanish, or not all of them, filled with numbers; how each is said."""
    found = {}
    for line, file in lines.items():
        if line in MADE_OF_OTHERS or str(file.relative_to(ROOT)) in ELSEWHERE:
            continue
        english = form.replace(GAP, line).replace(GAP, "17")
        spanish = ES.messages.translate(english)
        if spanish == english or ENGLISH.search(TYPED.sub("", spanish)):
            found[line] = spanish
    return found


def test_every_refusal_is_known() -> None:
    assert unknown(said(ERRORS, files())) == {}


def test_what_is_made_of_others_and_said_elsewhere_is_there() -> None:
    lines = said(ERRORS, files()) | said({"Issue": (1,)}, files())
    assert set(lines) >= MADE_OF_OTHERS
    assert {str(file.relative_to(ROOT)) for file in lines.values()} >= set(ELSEWHERE)


def test_every_refusal_is_said_after_the_name_of_its_file_as_by_itself() -> None:
    for line, file in said(ERRORS, files()).items():
        if line in MADE_OF_OTHERS or str(file.relative_to(ROOT)) in ELSEWHERE:
            continue
        filled = line.replace(GAP, "17")
        assert ES.messages.translate(f"plate.dxf:12: {filled}") == f"plate.dxf:12: {ES.messages.translate(filled)}"


def test_every_refusal_of_a_value_in_a_file_is_known() -> None:
    of_values = files("read/machine.py", "read/toml_table.py", "read/tools.py")
    assert unknown(said({"problem": (1,), "refuse": (1,)}, of_values), "'17' {}") == {}
    of_plans = files("read/plan_file.py", "processes/sheet/plan/apply_plan_file.py")
    assert unknown(said({"refuse": (1,)}, of_plans)) == {}


def test_every_refusal_of_a_file_of_options_is_known() -> None:
    lines = said({"refused": (0,)}, files("processes/settings.py"))
    lines |= said({"refused": (1,)}, files("gcode/dialects.py"))
    assert unknown({line: file for line, file in lines.items() if "at the top and at the top" not in line}) == {}


def test_every_reason_to_leave_out_an_entity_is_known() -> None:
    rows = {"csvmap.py": "row skipped: {}", "xmlmap.py": "point skipped: {}"}
    for file in files("read"):
        if file.name != "registry.py":  # who writes a reader is told there
            assert unknown(said({"ValueError": (0,)}, [file]), rows.get(file.name, "17 ARC skipped: {}")) == {}


def test_every_reason_in_a_list_of_reasons_is_known() -> None:
    rooms = files("read/dxf.py", "processes/nesting/proof.py", "processes/program/proof/matching.py")
    assert unknown(said({"append": (0,)}, rooms)) == {}


def test_every_issue_is_known() -> None:
    assert unknown(said({"Issue": (1,)}, files())) == {}
    assert unknown({line: file for line, file in said({"Issue": (2,)}, files()).items() if "id {}" not in line}) == {}
    assert unknown(said({"_Remark": (1,)}, files())) == unknown(said({"_Remark": (2,)}, files())) == {}


def test_every_reason_why_a_block_of_a_program_stays_is_known() -> None:
    file = ROOT / "processes/program/plan/sections/program_rows.py"
    lines = [*program_rows._BARRIERS.values(), *program_rows._CHANGES.values(), find_sections.STAYING]
    assert unknown(dict.fromkeys(lines, file), "stays in its place: {}") == {}


def test_every_difference_of_two_programs_is_known() -> None:
    assert unknown(said({"Difference": (0, 3)}, files())) == {}
    assert unknown(said({"_wrong": (9,), "wrong": (0, 1)}, files("processes/sheet/proof"))) == {}


def test_every_word_of_progress_is_known() -> None:
    assert unknown(said({"tell": (0,), "progress": (0,), "trial": (0,)}, files())) == {}


def test_no_line_has_two_translations() -> None:
    """A file of messages has no line twice, be it in two of its sections: the first would never be said."""
    for file in (ROOT / "studio" / "texts").glob("messages_*.toml"):
        lines = [line for section in tomllib.loads(file.read_text(encoding="utf-8")).values() for line in section]
        assert [line for line, count in Counter(lines).items() if count > 1] == []


def test_translations_fill_the_same_gaps() -> None:
    for line, translated in ES.messages.table.items():
        count = line.count("{}")
        numbered = {int(n) for n in re.findall(r"\{(\d+)\}", translated)}
        assert translated.count("{}") == count or (numbered and max(numbered) < count), line
        if count:
            translated.format(*range(count))


def test_no_line_is_kept_that_leafcut_says_no_more() -> None:
    """Every line is a text of the source, as it stands or with what else stands in its gaps."""
    texts = {text for file in files() for text in texts_of(source_of(file))}
    heap = "\n".join(texts)
    for line in ES.messages.table:
        pieces = [piece.split() for piece in line.split(GAP) if piece.strip()]
        threes = {" ".join(some[k : k + 3]) for some in pieces for k in range(max(len(some) - 2, 1))}
        # Two texts may meet in a line: "arc clockwise" and "{} to {}", "inner {} outer" and "after".
        met = {" ".join(some[:-1]) for some in pieces if some[1:]}
        met |= {line[: word.start()] + GAP + line[word.end() :] for word in re.finditer(r"[\w-]+", line)}
        assert met & texts or any(three.strip("'\" ,;:()") in heap for three in threes), line


def texts_of(source: Source) -> Iterable[str]:
    """Return the texts of a file, each with its gaps."""
    for node in ast.walk(source.tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value
        elif isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else GAP for part in node.values)


@pytest.mark.parametrize(
    ("english", "spanish"),
    [
        ("plate.dxf: the file is empty", "plate.dxf: el archivo está vacío"),
        ("--thickness: '1/0in' is divided by 0", "“Espesor”: '1/0in' está dividido por 0"),
        ("unknown machine 'foo'; did you mean 'fo'?", "máquina desconocida 'foo'; ¿quiso decir 'fo'?"),
        ("a line that nobody knows", "a line that nobody knows"),
        ("cut.nc:12: G81: a cycle with no repeats", "cut.nc:12: G81: un ciclo sin repeticiones"),
        (
            "pierce height: the torch goes on at Z1.5, not at the pierce height, Z3.8 (line 12)",
            "altura de perforación: la antorcha se enciende en Z1.5, no en la altura de perforación, Z3.8 (línea 12)",
        ),
        (
            "changed hole: at X1.000 Y2.000: peck 3 became 4; tool 1 became 2 (original line 5, line 7)",
            "agujero cambiado: en X1.000 Y2.000: picoteo 3 pasó a 4; herramienta 1 pasó a 2 "
            "(línea original 5, línea 7)",
        ),
        ("l.toml: 'depth' is wrong: '3mn' is not a number", "l.toml: 'depth' no es válido: '3mn' no es un número"),
        ("plate.dxf: nothing is left to cut or mark", "plate.dxf: no queda nada que cortar ni marcar"),
        ("stopped", "detenido"),
        (
            "line 40 'G0 Z0.5 M7': error 20: the controller does not have this word; the machine is standing still; "
            "it stands at X1.000 Y2.000 Z-0.500 (machine coordinates); it was in line 44, hole 11; "
            "lines up to 60 of 287 were taken; go on with --from-hole 11",
            "línea 40 'G0 Z0.5 M7': error 20: el control no tiene esta palabra; la máquina está parada; "
            "está en X1.000 Y2.000 Z-0.500 (coordenadas de máquina); estaba en la línea 44, agujero 11; "
            "se aceptaron las líneas hasta la 60 de 287; siga con “Desde el agujero” 11",
        ),
        (
            "line 12 'G1 Z-1': alarm 1: a limit switch was reached: the machine stood still at once, and its "
            "position is lost; home it",
            "línea 12 'G1 Z-1': alarma 1: se alcanzó un final de carrera: la máquina se paró en seco y su "
            "posición se perdió; haga el recorrido de referencia",
        ),
        ("12 holes outside the selected diameters left out", "se omiten por su diámetro: 12 agujeros"),
        ("", ""),
    ],
)
def test_a_line_is_said_in_spanish_with_the_names_of_the_form(english: str, spanish: str) -> None:
    assert ES.plain(english) == spanish
    assert words("en").plain("the file is empty") == "the file is empty"


def test_what_was_typed_is_not_translated() -> None:
    made = Messages({"'{}' is no {}": "'{}' no es {}", "a hole": "un agujero"})
    assert made.translate("'a thing' is no a hole") == "'a thing' no es un agujero"
    assert made.translate("'(((((' is no ))))))") == "'(((((' no es ))))))"
