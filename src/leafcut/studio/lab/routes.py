"""Routes for the experiments."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, HTTPException, Path
from fastapi.responses import Response

from leafcut.studio.lab.runs import LabRuns
from leafcut.studio.studio import STILL_POLICY


def add_lab(routes: APIRouter, lab: LabRuns) -> None:
    """Add the routes for reports and runs."""

    @routes.get("/lab/{name}/{file}", summary="The report (report.html) or the runs (runs.csv) of an experiment")
    def experiment(
        name: Annotated[str, Path(max_length=60)], file: Annotated[str, Path(max_length=20)], reduced: bool = False
    ) -> Response:
        from leafcut.lab.page import experiment_page_html, rows_as_csv
        from leafcut.lab.running import has_enough_cores

        if file not in ("report.html", "runs.csv"):
            raise HTTPException(404, "the file does not exist")
        description = lab.load_description(name, reduced)
        rows = lab.rows(description)
        headers = {"content-security-policy": STILL_POLICY}
        if file == "runs.csv":
            headers["content-disposition"] = f'attachment; filename="{description.name}.csv"'
            return Response(rows_as_csv(description, rows), media_type="text/csv; charset=utf-8", headers=headers)
        n_possible = sum(has_enough_cores(description, plan) for plan in description.runs())
        page = experiment_page_html(description, rows, n_possible, description.n_runs - n_possible)
        return Response(page, media_type="text/html; charset=utf-8", headers=headers)
