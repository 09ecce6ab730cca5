"""The user's machines and tools are validated as by leafcut; inputs are recognised."""

from __future__ import annotations

from pathlib import Path

import pytest

from leafcut.errors import LeafcutError, OptionError
from leafcut.studio.folder import BUILT_IN
from leafcut.studio.jobs.history import JobState
from leafcut.studio.jobs.preview import read_preview
from leafcut.studio.jobs.task import Task
from leafcut.studio.page import library
from leafcut.studio.studio import Studio

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_the_library_to_begin_with_is_the_one_among_the_examples() -> None:
    assert library.shipped_text("tools", "example") == (EXAMPLES / "tools.toml").read_text(encoding="utf-8")


@pytest.mark.parametrize("kind", ["machines", "tools"])
def test_all_that_is_shipped_can_be_copied_and_used(studio: Studio, kind: str) -> None:
    for name in library.shipped_names(kind):
        library.save_profile(studio.folder, kind, f"my-{name}", library.shipped_text(kind, name))
    assert studio.folder.own_names(kind) == sorted(f"my-{name}" for name in library.shipped_names(kind))
    option = {"machines": {"machine": "mine:my-haas-vf2"}, "tools": {"tools": "mine:my-example"}}[kind]
    job = studio.jobs.start(Task("optimize", ("example:plate-10",), options={"depth": "3", **option, "preset": "fast"}))
    assert studio.jobs.wait(job) is JobState.DONE
    library.delete_profile(studio.folder, kind, f"my-{library.shipped_names(kind)[0]}")
    assert f"my-{library.shipped_names(kind)[0]}" not in studio.folder.own_names(kind)


def test_what_leafcut_would_not_read_is_not_saved(studio: Studio) -> None:
    good = library.shipped_text("machines", "haas-vf2")
    for name, text, line in (
        ("my-mill", good.replace("controller", "controler", 1), "my-mill.toml: unknown key 'controler'"),
        ("my-mill", "x" * 300_000, "longer than"),
        ("my-mill", "= 1", "my-mill.toml: not a TOML file"),
        ("haas-vf2", good, "give yours another name"),
        ("../mill", good, "is not a valid name"),
        ("", good, "is not a valid name"),
        ("Mill", good, "is not a valid name"),
    ):
        with pytest.raises(OptionError, match=line):
            library.save_profile(studio.folder, "machines", name, text)
    assert studio.folder.own_names("machines") == []
    for name in ("../key", "absent"):
        with pytest.raises(OptionError):
            library.own_text(studio.folder, "machines", name)
        with pytest.raises(OptionError):
            library.shipped_text("tools", name)


@pytest.mark.parametrize(
    ("source", "works", "layers"),
    [
        (str(EXAMPLES / "plate_10.dxf"), ("drill", "cut", "nest", "pocket", "part"), {"part", "whole"}),
        (str(EXAMPLES / "cam_121.nc"), ("program", "simulate", "verify"), {"after"}),
        ("example:plate-10", ("drill", "solve"), {"part"}),
        ("random:12", ("drill", "solve"), {"part"}),
    ],
)
def test_an_input_is_seen_for_what_can_be_done_with_it(source: str, works: tuple[str, ...], layers: set[str]) -> None:
    seen = read_preview(source)
    assert (seen.works, set(seen.scenes), seen.error) == (works, layers, "")
    assert all(value for _, value in seen.facts)
    assert source.startswith(BUILT_IN) or Path(source).is_file()


def test_the_same_drawing_is_seen_in_several_ways(tmp_path: Path) -> None:
    drawing = tmp_path / "sheet.svg"
    drawing.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="50mm" height="50mm" viewBox="0 0 50 50">'
        '<path fill="none" stroke="black" d="M5 5H45V45H5Z"/></svg>'
    )
    assert dict(read_preview(str(drawing)).facts)["contours"] == "1"
    assert dict(read_preview(str(drawing), "pocket").facts)["pockets"] == "1"
    for work in ("cut", "pocket"):
        seen = read_preview(str(drawing), work)
        assert (seen.work, seen.works) == (work, ("cut", "nest", "pocket", "part"))


def test_what_cannot_be_read_in_one_way_says_why_and_what_else_there_is(tmp_path: Path) -> None:
    program = tmp_path / "odd.nc"
    program.write_text("%\nG21 G90\nG0 X1 Y1\nG2 X5 Y5 I1000 J3\nM30\n%\n")
    seen = read_preview(str(program))
    assert seen.works == ("program", "simulate", "verify")
    assert "odd.nc" in seen.error
    assert len(seen.error.splitlines()) == 1
    with pytest.raises(LeafcutError, match="unknown file format"):
        read_preview(str(EXAMPLES.parent / "Makefile"))


def test_a_page_names_no_file_of_a_dialect_but_one_that_lies_beside_a_machine_of_ones_own_is_used(
    studio: Studio,
) -> None:
    plate = ("example:plate-10",)
    for path in ("ours.toml", "/etc/ours.toml"):
        with pytest.raises(OptionError, match="--dialect: choose a file opened in the studio, not a path"):
            studio.jobs.start(Task("optimize", plate, options={"dialect": path}))
    text = library.shipped_text("machines", "haas-vf2").replace(
        'controller = "haas"', 'controller = "controls/a.toml"', 1
    )
    with pytest.raises(OptionError, match=r"'controls/a\.toml', which does not exist in the folder"):
        library.save_profile(studio.folder, "machines", "mine", text)
    folder = studio.folder.root / "machines"
    (folder / "controls").mkdir()
    (folder / "controls" / "a.toml").write_text('base = "haas"\nextension = ".eia"\n')
    (folder / "mine.toml").write_text(text)
    job = studio.jobs.start(Task("optimize", plate, options={"depth": "3", "machine": "mine:mine", "preset": "fast"}))
    assert studio.jobs.wait(job) is JobState.DONE
    assert studio.history.artefacts(job)["program"] == "plate-10.eia"
