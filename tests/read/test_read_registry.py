"""Which reader takes a file, and what is refused before any reader sees it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leafcut.errors import LeafcutError, ReadError
from leafcut.model.issue import Issue
from leafcut.model.part import Hole, Part
from leafcut.options import ReadOptions
from leafcut.read import Format, Match, format, formats, read, registry
from leafcut.read.examples import EXAMPLE_NAMES
from leafcut.read.format import Source
from packages import Installer

EXCELLON = "M48\nMETRIC\nT1C1.0\n%\nT1\nX1.0Y2.0\nX3.0Y4.0\nM30\n"
XML = '<map units="mm"><city name="A" x="1" y="2"/></map>'
TSP = "NAME: x\nTYPE: TSP\nDIMENSION: 2\nEDGE_WEIGHT_TYPE: EUC_2D\nNODE_COORD_SECTION\n1 0 0\n2 3 4\nEOF\n"
CSV = "1, 2\n3, 4\n"
DXF = "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n1\n20\n2\n40\n3\n0\nENDSEC\n0\nEOF\n"


@pytest.mark.parametrize(
    "name, text, expected",
    [
        ("plate.dxf", DXF, "dxf"),
        ("plate", DXF, "dxf"),
        ("PLATE.DXF", DXF, "dxf"),
        ("board.drl", EXCELLON, "excellon"),
        ("board.txt", EXCELLON, "excellon"),
        ("points.xml", XML, "xml"),
        ("points", XML, "xml"),
        ("points.csv", CSV, "csv"),
        ("points.txt", CSV, "csv"),
        ("points.XY", CSV, "csv"),
        ("cities.tsp", TSP, "tsplib"),
        ("cities.txt", TSP, "tsplib"),
        ("really_a_board.csv", EXCELLON, "excellon"),
        ("really_xml.dxf", XML, "xml"),
    ],
)
def test_a_format_is_chosen_by_content_and_extension(text_file, name, text, expected):
    part = read(text_file(name, text))
    assert part.format == expected
    assert part.source == name


def test_extensions_are_listed_in_lower_case_as_files_are_compared():
    for known in formats():
        assert all(extension == extension.lower() and extension.startswith(".") for extension in known.extensions)


@pytest.mark.parametrize("line", ["G1 X100 F1000 " * 300_000, "G1 X1000Y2000" * 20 + "?", "N10 G1 X[1]Y[2]" * 50])
def test_a_program_is_known_by_its_look_at_once_whatever_its_lines_are_like(line):
    data = f"G21 G90\n{line}\n".encode()
    assert registry.choose_format(formats(), Source("long.nc", data)).name == "gcode"


def test_an_unknown_kind_of_file_is_told_what_there_is(text_file):
    with pytest.raises(ReadError, match=r"unknown file format.*dxf.*excellon.*xml.*csv.*tsplib"):
        read(text_file("letter.txt", "Dear machine,\nplease drill holes.\n"))


def test_missing_empty_unreadable_files_and_folders_are_refused_in_one_line(tmp_path, monkeypatch):
    (tmp_path / "empty.dxf").write_text("  \n")
    os.mkfifo(tmp_path / "pipe.dxf")
    for name, words in {
        "none.dxf": "file not found",
        "empty.dxf": "empty",
        "pipe.dxf": "not a regular file",
        ".": "folder",
        "nul\0.dxf": "not a valid file name",
        "n" * 300 + ".dxf": "cannot be read",
    }.items():
        with pytest.raises(ReadError, match=words) as caught:
            read(f"{tmp_path}/{name}")
        assert "\n" not in str(caught.value)

    def denied(*_args, **_more):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", denied)
    with pytest.raises(ReadError, match="Permission denied"):
        read(tmp_path / "empty.dxf")


def test_a_file_over_the_limit_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(format, "MAX_BYTES", 1 << 20)
    path = tmp_path / "large.dxf"
    with path.open("wb") as stream:
        stream.truncate((1 << 20) + 1)
    with pytest.raises(ReadError, match="the limit is 1 MiB"):
        read(path)


def test_every_format_has_a_name_and_one_line_of_help():
    known = formats()
    names = [
        "dxf",
        "svg",
        "step",
        "sirius",
        "wkt",
        "picture",
        "excellon",
        "gerber",
        "xml",
        "csv",
        "tsplib",
        "gtsp",
        "gcode",
        "example",
    ]
    assert [f.name for f in known[: len(names)]] == names
    assert all(f.help and "\n" not in f.help for f in known)
    extensions = [e for f in known for e in f.extensions]
    assert len(extensions) == len(set(extensions))


def test_the_help_of_the_examples_names_all_of_them():
    (example,) = [f for f in registry.BUILT_IN if f.name == "example"]
    assert f"{{{', '.join(EXAMPLE_NAMES)}}}" in example.help


@pytest.mark.parametrize("name, text", [("a.nc", "G21\nG1 X1 F100\n"), ("a", XML), ("a.txt", "no format knows this")])
def test_a_file_is_recognised_without_loading_any_reader(text_file, name, text):
    code = (
        "import sys; from leafcut.read.registry import BUILT_IN, detect_format_name; "
        f"detect_format_name({str(text_file(name, text))!r}); "
        "print(sorted({f'leafcut.read.{m}' for m in sys.argv[1:]} & set(sys.modules)))"
    )
    readers = [
        "csvmap",
        "dxf",
        "dxf_document",
        "excellon",
        "gtsp",
        "picture",
        "sirius",
        "step",
        "svg",
        "tsplib",
        "wkt",
        "xmlmap",
    ]
    done = subprocess.run([sys.executable, "-c", code, *readers], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def read_toy(source: Source, options: ReadOptions) -> Part:
    """Read the toy format: one number per line is x."""
    return Part(source.name, tuple(Hole(float(x), 0, 1) for x in source.text().split()), format="toy")


def crash(source: Source, options: ReadOptions) -> Part:
    """Fail as a stranger's code does."""
    raise KeyError("oh\nno")


TOY = Format("toy", (".toy",), "a toy", read_toy)
CRASHING = Format("crash", (".crash",), "crashes", crash, lambda head: 1 / 0)


@pytest.fixture
def plugins(install: Installer) -> None:
    """Install a package with a working and a crashing reader, and with broken ones."""
    names = ("TOY", "CRASHING", "no_such_thing", "read_toy")
    here = {name.lower(): f"{__name__}:{name}" for name in names}
    install("toys", {"leafcut.readers": {**here, "gone": "no_such_module:FORMAT"}})


def test_a_plugin_adds_a_format(plugins, text_file):
    assert [h.x for h in read(text_file("a.toy", "3 4")).holes] == [3, 4]


def test_a_broken_plugin_shows_its_error_and_stops_nothing_else(plugins, text_file):
    broken = {f.name: f.error for f in formats() if f.error}
    assert set(broken) == {"no_such_thing", "read_toy", "gone"}
    assert "ModuleNotFoundError" in broken["gone"]
    assert read(text_file("plate.dxf", DXF)).holes


def test_whatever_a_reader_raises_becomes_a_read_error_of_one_line(plugins, text_file):
    with pytest.raises(ReadError, match=r"could not be read as crash \(KeyError: .*oh.*no") as caught:
        read(text_file("a.crash", "x"))
    assert "\n" not in str(caught.value)


def test_strict_names_the_first_warning_and_counts_the_rest(text_file, monkeypatch):
    warnings = (Issue("L203", "one"), Issue("L208", "two", "a.csv:3"))
    noisy = Format("noisy", (".noisy",), "noisy", lambda s, o: Part("n", (Hole(0, 0, 1),), issues=warnings))
    monkeypatch.setattr(registry, "formats", lambda: (noisy,))
    path = text_file("a.noisy", "x")
    assert len(read(path).issues) == 2
    with pytest.raises(ReadError, match="refused by --strict: L203 one, and 1 more"):
        read(path, ReadOptions(strict=True))


@settings(max_examples=settings().max_examples * 5)
@given(st.binary(min_size=1, max_size=300), st.sampled_from([f for f in registry.BUILT_IN if f.extensions]))
def test_any_bytes_given_to_any_reader_end_in_a_part_or_a_leafcut_error(data, format_):
    source = Source(f"file{format_.extensions[0]}", data)
    assert isinstance(format_.sniff(data), Match)
    try:
        part = format_.read(source, ReadOptions())
    except LeafcutError as problem:
        assert "\n" not in str(problem)
    else:
        assert part.holes or part.slots


@settings(max_examples=settings().max_examples * 5)
@given(st.text(alphabet="XYTCGMR0123456789.-%;,\n <>=\"'/abcity:_ENODSCR", max_size=300))
def test_any_text_that_looks_nearly_right_ends_in_a_part_or_a_leafcut_error(text):
    heads = {"excellon": "M48\nMETRIC\nT1C1.0\n%\nT1\n", "xml": "<map><city ", "tsplib": TSP[:-5], "csv": "x,y\n"}
    for format_ in registry.BUILT_IN:
        if format_.name in heads:
            try:
                part = format_.read(Source("file", (heads[format_.name] + text).encode()), ReadOptions())
            except LeafcutError as problem:
                assert "\n" not in str(problem)
            else:
                assert part.holes or part.slots
