"""Two states of the code are compared byte for byte: what one clock measured is left out, nothing else."""

from __future__ import annotations

from pathlib import Path

from benchmarked import benchmark

golden = benchmark("golden")


def test_every_byte_of_two_runs_is_the_same_and_a_changed_a_missing_and_a_new_file_are_named(tmp_path: Path) -> None:
    one, other = tmp_path / "one", tmp_path / "other"
    for folder in (one, other):
        golden.write(folder, "drill/plate_10.dxf/haas")
    place = Path("drill/plate_10.dxf/haas-vf2")
    made = sorted(file.name for file in (one / place).iterdir())
    assert made == ["after.scene", "answer.json", "before.scene", "part.scene", "program.nc", "report.html"]
    assert golden.compare(one, other) == []

    program = other / place / "program.nc"
    program.write_bytes(program.read_bytes().replace(b"G81", b"G82", 1))
    (other / place / "report.html").unlink()
    (other / "more.txt").write_text("new")
    names = [str(place / "program.nc"), str(place / "report.html"), "more.txt"]
    assert golden.compare(one, other) == sorted(names)
