"""Check that the Spanish catalogue contains exactly the messages of the source."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path

import sources
from message_lines import GAP, message_lines, texts_of

from leafcut import errors
from leafcut.processes.program.plan import find_sections, program_rows
from leafcut.studio.wording import words

ES = words("es")
CATALOGUE = sources.PACKAGE / "studio" / "texts" / "messages_es.toml"
#: Error classes, and functions that raise them → index of the argument that contains the message.
ERRORS = {
    **{name: (0,) for name in dir(errors) if name.endswith("Error")},
    **dict.fromkeys(("OutputError", "BlockError", "UnclearBlock", "NesterError"), (0,)),
    **dict.fromkeys(("_RunEnded", "_AlarmStop", "_NoAnswer", "PortLost"), (0,)),  # of the sender
    "ReadError": (1,),
    "parser_errors": (1,),
}
#: Commands outside the studio → files whose errors only these commands show, in addition to the command line.
NOT_IN_STUDIO = {
    "many inputs": ("order/executors.py",),
    "cutting-data": (
        "processes/cutting_data/run.py",
        "processes/cutting_data/drawn_work.py",
        "processes/cutting_data/limits.py",
        "processes/cutting_data/saving.py",
        "read/work_materials.py",
        "report/front_chart.py",
    ),
    "install": ("addons/__init__.py",),
    "lab": (
        "lab/description.py",
        "lab/description_table.py",
        "lab/analysis_blocks.py",
        "lab/loading.py",
        "lab/message_costs.py",
        "lab/page.py",
        "lab/statistics.py",
        "lab/tuning.py",
    ),
    "machine and tools": (
        "read/controllers/fluidnc.py",
        "read/controllers/importing.py",
        "read/controllers/ini_text.py",
        "read/controllers/mach.py",
        "read/controllers/questions.py",
        "read/time_table.py",
        "read/tool_text.py",
    ),
    "stock": ("report/stock_report.py",),
    "studio, before its page is open": ("studio/server/app.py",),
}
SKIPPED_FILES = {f"src/leafcut/{file}" for files in NOT_IN_STUDIO.values() for file in files}
COMMAND_LINE = "src/leafcut/cli/"
#: Lines that consist of other lines, each of which is translated separately.
COMPOSED = {
    "--baud {}: {}",
    "the {} '{}' is a {}",
    "the reader '{}' is a {}",
    "{} is active is not known",
    "{} on {}: {}",
    "--workpiece {}: {}",
    "{} on {}: {} ({} times)",
    "{}: {} {}{}, {} mm² in all remain uncut: a tool of {} mm cannot enter them",
    "{}: {} {}{}, {} mm² in all, cannot be reached by a tool of {} mm; the largest, {} mm² near ({}, {})",
}
#: English words that must not occur in Spanish lines, except in quotes and in flags with their values (`TYPED`).
ENGLISH = re.compile(
    r"(?<![\w'/-])(?:the|of|is|are|and|with|without|cannot|must|has|have|it|its|or|for|than|not|leave|give|choose|an|be"
    r"|by|to|in|at|on|this|that|was|more|only|from|which|before|after|near|needs)(?![\w'/-])"
)
TYPED = re.compile(r"(?<!\w)'[^']*'|--[a-z-]+(?: on\b| off\b)?|mm o in\b")
#: Example value for each gap.
VALUE = "17"


def faults() -> Iterator[str]:
    """Yield every fault."""
    refusals = message_lines(ERRORS, sources.modules())
    issues = message_lines({"Issue": (1,)}, sources.modules())
    yield from untranslated(refusals)
    yield from untranslated(issues)
    yield from broken_by_file_name(refusals)
    for form, lines in other_lines():
        yield from untranslated(lines, form)
    yield from stale_exceptions(refusals | issues)
    yield from faults_of_catalogue()


def other_lines() -> Iterator[tuple[str, Mapping[str, str]]]:
    """Yield the lines of all other kinds, each kind with the form of the whole message."""
    modules = sources.modules
    rows = {"csvmap.py": "row skipped: {}", "xmlmap.py": "point skipped: {}"}
    # Refusals of values in files.
    values = modules("read/machine.py", "read/toml_table.py", "read/tools.py")
    yield "'17' {}", message_lines({"problem": (1,), "refuse": (1,)}, values)
    plans = modules("read/plan_file.py", "processes/sheet/plan/plan_file.py")
    yield GAP, message_lines({"refuse": (1,)}, plans)
    yield (
        GAP,
        {
            line: place
            for line, place in message_lines({"refused": (0,)}, modules("processes/settings.py")).items()
            if "at the top and at the top" not in line
        },
    )
    yield GAP, message_lines({"refused": (1,)}, modules("gcode/dialects.py"))
    # Entities that a reader skips. The errors of the registry are for authors of plug-ins.
    for file in modules("read"):
        if file.name != "registry.py" and re.search(r'ValueError\(f?"', sources.text_of(file)):
            yield rows.get(file.name, "17 ARC skipped: {}"), message_lines({"ValueError": (0,)}, [file])
    # Differences of programs, and reasons in lists.
    lists = modules("read/dxf.py", "nesting/proof.py", "processes/program/proof/matching.py")
    yield GAP, message_lines({"append": (0,)}, lists)
    yield GAP, message_lines({"Difference": (0, 3)}, modules())
    yield GAP, message_lines({"sheet_difference": (0, 1)}, modules("processes/sheet/proof"))
    # Issues: positions and remarks.
    places = message_lines({"Issue": (2,)}, modules()).items()
    yield GAP, {line: place for line, place in places if "id {}" not in line}
    contours = modules("processes/sheet/plan/contours.py")
    yield GAP, message_lines({"_contour_issue": (1,)}, contours)
    yield GAP, message_lines({"_contour_issue": (2,)}, contours)
    # Blocks of a program that are not moved, and progress.
    staying = [*program_rows._BARRIERS.values(), *program_rows._CHANGES.values(), find_sections.STAYING]
    yield "stays in its place: {}", dict.fromkeys(staying, sources.place(Path(str(program_rows.__file__)).resolve()))
    steps = dict.fromkeys(("report", "start_step", "search_progress", "Progress"), (0,))
    yield GAP, message_lines(steps, modules())


def _in_studio(lines: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    for line, place in lines.items():
        file = place.partition(":")[0]
        if line not in COMPOSED and file not in SKIPPED_FILES and not file.startswith(COMMAND_LINE):
            yield line, place


def untranslated(lines: Mapping[str, str], form: str = GAP) -> Iterator[str]:
    """Yield lines without a complete Spanish translation."""
    for line, place in _in_studio(lines):
        english = form.replace(GAP, line).replace(GAP, VALUE)
        spanish = ES.messages.translate(english)
        if spanish == english:
            yield f"{place}: no Spanish for {line!r}"
        elif ENGLISH.search(TYPED.sub("", spanish)):
            yield f"{place}: English in the Spanish of {line!r}: {spanish!r}"


def broken_by_file_name(lines: Mapping[str, str]) -> Iterator[str]:
    """Yield lines whose translation changes when the name of a file precedes them."""
    for line, place in _in_studio(lines):
        text = line.replace(GAP, VALUE)
        alone, after_name = ES.messages.translate(text), ES.messages.translate(f"plate.dxf:12: {text}")
        if after_name != f"plate.dxf:12: {alone}":
            yield f"{place}: after a file name {line!r} becomes {after_name!r}"


def stale_exceptions(lines: Mapping[str, str]) -> Iterator[str]:
    """Yield exceptions of this check that match no line in the source."""
    for line in sorted(COMPOSED - lines.keys()):
        yield f"tools/lint/messages.py: COMPOSED has {line!r}, the source does not"
    for file in sorted(SKIPPED_FILES - {place.partition(":")[0] for place in lines.values()}):
        yield f"tools/lint/messages.py: NOT_IN_STUDIO has {file}, which has no message"


def faults_of_catalogue() -> Iterator[str]:
    """Yield lines that occur twice, have other gaps than their translation, or are not in the source."""
    texts = {text for file in sources.modules() for text in texts_of(file)}
    all_texts = "\n".join(texts)
    seen: set[str] = set()
    for section in tomllib.loads(sources.text_of(CATALOGUE)).values():
        for line, translation in section.items():
            if line in seen:
                yield f"{_place_in_catalogue(line)}: {line!r} occurs twice"
            seen.add(line)
            if not _has_gaps_of(line, translation):
                yield f"{_place_in_catalogue(line)}: {line!r} and {translation!r} have different gaps"
            if not _is_in_source(line, texts, all_texts):
                yield f"{_place_in_catalogue(line)}: no source has {line!r}"


def _has_gaps_of(line: str, translation: str) -> bool:
    gaps = line.count(GAP)
    if not gaps:
        return True
    try:
        translation.format(*range(gaps))
    except (IndexError, KeyError, ValueError):
        return False
    return translation.count(GAP) == gaps or bool(re.search(r"\{\d+\}", translation))


def _place_in_catalogue(line: str) -> str:
    for number, text in enumerate(sources.text_of(CATALOGUE).splitlines(), 1):
        if text.startswith((f'"{line}"', f"'{line}'")):
            return sources.place(CATALOGUE, number)
    return sources.place(CATALOGUE)


def _is_in_source(line: str, texts: set[str], all_texts: str) -> bool:
    """Return whether the source contains three consecutive words of the line, or the line with one word as a gap.

    A line may join two texts: "arc clockwise" and "{} to {}".
    """
    pieces = [piece.split() for piece in line.split(GAP) if piece.strip()]
    triples = {" ".join(words[k : k + 3]) for words in pieces for k in range(max(len(words) - 2, 1))}
    joined = {" ".join(words[:-1]) for words in pieces if words[1:]}
    joined |= {line[: word.start()] + GAP + line[word.end() :] for word in re.finditer(r"[\w-]+", line)}
    return bool(joined & texts) or any(triple.strip("'\" ,;:()") in all_texts for triple in triples)
