"""Two folders of outputs are compared byte for byte; only measured seconds are left out."""

from __future__ import annotations

import shutil
from pathlib import Path

from benchmarks import golden


def test_changed_missing_and_new_files_are_named(tmp_path: Path) -> None:
    before, after = tmp_path / "before", tmp_path / "after"
    (before / "drill").mkdir(parents=True)
    for name in ("program.nc", "report.html", "answer.json"):
        (before / "drill" / name).write_text(f"{name}\nG81\n")
    shutil.copytree(before, after)
    assert golden.compare(before, after) == []
    (after / "drill" / "program.nc").write_text("program.nc\nG82\n")
    (after / "drill" / "report.html").unlink()
    (after / "more.txt").write_text("new")
    names = [str(Path("drill") / name) for name in ("program.nc", "report.html")]
    assert golden.compare(before, after) == sorted([*names, "more.txt"])


def test_every_job_has_a_name_of_its_own_and_an_input() -> None:
    jobs = list(golden.jobs())
    assert len({name for name, *_ in jobs}) == len(jobs) > 100
    assert all((golden.ROOT / source).exists() for _, source, *_ in jobs)
