"""JSON API for other programs (optimize, solve, nest, simulate and verify), and routes for the studio page.

``/api/openapi.json`` documents the API. Other programs send the token from the studio's folder as ``Authorization:
Bearer TOKEN``. An answer is a JSON object; ``schema`` is the number of its format. An error is a JSON object with one
key, ``error``: a message in one line.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import APIRouter, FastAPI, File, Form, HTTPException, Path, Query, Request, Security, UploadFile
from fastapi.responses import JSONResponse, Response
from fastapi.security import HTTPBearer
from pydantic import BaseModel
from starlette.staticfiles import StaticFiles

from leafcut.errors import LeafcutError, OptionError
from leafcut.files.schemas import ANSWER, add_schema_number
from leafcut.message import Message, messages_to_json
from leafcut.options.option_spec import flag_name
from leafcut.processes import registry
from leafcut.studio.folder import Folder
from leafcut.studio.jobs.history import JobRecord, possible_upload_ids
from leafcut.studio.jobs.jobs import Jobs, error_line
from leafcut.studio.jobs.nest_request import wanted_parts
from leafcut.studio.jobs.sheets import compare_variants, sheets_in_answer, start_cut_planning
from leafcut.studio.jobs.task import Task
from leafcut.studio.studio import STILL_POLICY, Studio

#: Media types of files that a browser may open in a new tab.
_SHOWN = ("image/svg+xml", "text/html; charset=utf-8")

JobId = Annotated[str, Path(pattern="^[A-Za-z0-9_-]{12}$", description="a job's id")]
Upload = Annotated[UploadFile | None, File(description="a file that leafcut reads")]
Named = Annotated[str, Form(description="instead of a file: example:plate-70, random:200:7")]
Options = Annotated[str, Form(description='a JSON object of options: {"machine": "haas-vf2", "thickness": "3mm"}')]

_KEPT = {"cache-control": "private, max-age=31536000, immutable"}


def add_static(app: FastAPI) -> None:
    """Add the static files of the page, and the colours that leafcut's reports use."""
    css = colours_css()

    @app.get("/static/colours.css", include_in_schema=False)
    def colours() -> Response:
        return Response(css, media_type="text/css", headers=_KEPT)

    app.mount("/static", _StaticFiles(packages=[("leafcut.studio", "static")]))


class _StaticFiles(StaticFiles):
    """Static files with versioned addresses, so that browsers can cache them."""

    def file_response(self, *arguments: Any, **named: Any) -> Response:
        answer = super().file_response(*arguments, **named)
        answer.headers.update(_KEPT)
        return answer


def colours_css() -> str:
    """Return the colours of the report as CSS. The theme may be light, dark, or follow the system."""
    from leafcut.report.styles import style_sheet

    light, dark = re.findall(r":root \{(.*?)\}", style_sheet("drawing.css"), flags=re.DOTALL)[:2]
    return (
        f":root {{ color-scheme: light; {light} }}\n"
        f"@media (prefers-color-scheme: dark) {{ :root:not([data-theme=light]) {{ color-scheme: dark; {dark} }} }}\n"
        f":root[data-theme=dark] {{ color-scheme: dark; {dark} }}\n"
    )


class _JsonAnswer(JSONResponse):
    """A JSON object with the number of its schema."""

    def render(self, content: Any) -> bytes:
        return super().render(add_schema_number(ANSWER, content))


class Refusal(BaseModel):
    """The body of every error response: the English text, and if it is a `Message`, its template and values."""

    error: str
    message: dict[str, Any] | None = None


#: Error statuses that every route may return, and their meanings.
_REFUSED: dict[int | str, dict[str, Any]] = {
    400: {"model": Refusal, "description": "unknown options, or values out of range"},
    401: {"model": Refusal, "description": "the token is missing"},
    403: {"model": Refusal, "description": "host or origin differs from the studio's"},
    404: {"model": Refusal, "description": "not found"},
    413: {"model": Refusal, "description": "request or upload too large"},
    422: {
        "model": Refusal,
        "description": "input that cannot be processed, or a missing or invalid field",
    },
    500: {"model": Refusal, "description": "an internal error in leafcut"},
}
_BINARY = {"type": "string", "format": "binary"}
_BODY = {"required": True, "content": {"application/octet-stream": {"schema": _BINARY}}}


def api_router(studio: Studio) -> APIRouter:
    """Create the routes of a studio under ``/api``."""
    token = HTTPBearer(auto_error=False, description="the token in the studio's folder")  # checked by the guard
    routes = APIRouter(
        prefix="/api", responses=_REFUSED, dependencies=[Security(token)], default_response_class=_JsonAnswer
    )
    _add_command_routes(routes, studio.folder, studio.jobs)
    _add_upload_route(routes, studio.folder)
    _add_job_routes(routes, studio.jobs)
    _add_list_routes(routes)
    _add_points_route(routes, studio.folder)
    for room in studio.rooms.values():
        room.add_routes(routes, studio)

    @routes.get("", include_in_schema=False)
    @routes.get("/{rest:path}", include_in_schema=False)
    def nothing(rest: str = "") -> None:
        raise HTTPException(404, "no page at this address")

    return routes


def error_response(_: Request, problem: Exception) -> JSONResponse:
    """Create the response to an error in leafcut or to an internal error."""
    status = 400 if isinstance(problem, OptionError) else 422 if isinstance(problem, LeafcutError) else 500
    return _json_error(error_line(problem), status)


def _json_error(line: str, status: int) -> JSONResponse:
    message = {"message": messages_to_json(line)} if isinstance(line, Message) else {}
    return JSONResponse({"error": line, **message}, status)


def http_error_response(_: Request, problem: Exception) -> JSONResponse:
    """Create the response to an error that a route has raised."""
    status, detail = getattr(problem, "status_code", 400), getattr(problem, "detail", "")
    if str(detail).startswith("Part exceeded"):  # message of the form parser
        detail = "a field of this request is larger than 1 MiB; only files may be"
    return _json_error(str(detail) or "this request is malformed", status)


def invalid_request_response(_: Request, problem: Exception) -> JSONResponse:
    """Create the response to a request whose fields are missing or invalid."""
    first: dict[str, Any] = next(iter(getattr(problem, "errors", list)()), {})
    place = " ".join(str(word) for word in first.get("loc", ())[1:])
    return JSONResponse({"error": f"{place}: {first.get('msg', 'cannot be understood')}".strip(": ")}, 422)


async def _store_upload(folder: Folder, file: UploadFile) -> str:
    """Store an upload in chunks, because it may be large. Return its id."""
    input_id, path = folder.new_input(file.filename or "file")
    with path.open("wb") as output:
        while chunk := await file.read(1 << 20):
            output.write(chunk)
    return input_id


async def _uploaded_or_named_input(folder: Folder, file: UploadFile | None, named: str) -> str:
    if file is not None:
        return await _store_upload(folder, file)
    if not named:
        raise OptionError("no file given; send one as 'file', or name a built-in part as 'source'")
    return named


def _parse_options(text: str) -> dict[str, Any]:
    try:
        options = json.loads(text or "{}")
    except (ValueError, RecursionError):
        options = None
    if not isinstance(options, dict):
        raise OptionError("'options' must be a JSON object")
    return options


async def _run_to_end(jobs: Jobs, task: Task, named: str = "") -> tuple[JobRecord, dict[str, Any]]:
    """Run a task and wait until it ends.

    If the task is refused, its uploads are deleted. An existing upload that the request has `named` is kept.
    """
    try:
        job = jobs.start(task)
    except BaseException:
        jobs.folder.delete_inputs(possible_upload_ids([replace(task, options={})]) - {named})
        raise
    await jobs.wait_without_blocking(job)
    record = jobs.record(job)
    if record is None or not record.state.has_result:
        live = jobs.find_live_job(job)
        status = 500 if live is not None and live.internal else 422
        raise HTTPException(status, (record.line if record else "") or "the job was cancelled")
    return record, jobs.history.answer(job) or {}


def _artefact_text(jobs: Jobs, job: str, name: str) -> str:
    artefact = jobs.history.artefact(job, name)
    return "" if artefact is None else artefact.text


def _add_command_routes(routes: APIRouter, folder: Folder, jobs: Jobs) -> None:
    @routes.post("/optimize", summary="A verified program from a drawing, or from another CAM's program")
    async def optimize(
        file: Upload = None, source: Named = "", process: Annotated[str, Form()] = "auto", options: Options = "{}"
    ) -> _JsonAnswer:
        """Return the answer of ``leafcut optimize --json``, the program as ``text``, and the job's id as ``job``."""
        given = _parse_options(options)
        task = Task("optimize", (await _uploaded_or_named_input(folder, file, source),), process, given)
        record, answer = await _run_to_end(jobs, task, "" if file is not None else source)
        return _JsonAnswer({**answer, "text": _artefact_text(jobs, record.id, "program"), "job": record.id})

    @routes.post("/solve", summary="A short closed tour through the points of a map")
    async def solve(file: Upload = None, source: Named = "", options: Options = "{}") -> _JsonAnswer:
        """Return the answer of ``leafcut solve --json``, the TSPLIB tour as ``text``, and the job's id as ``job``."""
        given = _parse_options(options)
        task = Task("solve", (await _uploaded_or_named_input(folder, file, source),), "auto", given)
        record, answer = await _run_to_end(jobs, task, "" if file is not None else source)
        return _JsonAnswer({**answer, "text": _artefact_text(jobs, record.id, "tour"), "job": record.id})

    @routes.post("/nest", summary="Nest parts with quantities on sheets, in several variants")
    async def nest(
        files: Annotated[list[UploadFile], File(description="drawings of parts")],
        parts: Annotated[
            str, Form(description='quantities, in the order of the files: [{"quantity": 10, "rotations": "0 90"}]')
        ] = "[]",
        options: Options = "{}",
    ) -> _JsonAnswer:
        """Return the answer of ``leafcut nest --json``, the drawings by name as ``texts``, and the id as ``job``."""
        given, parts_wanted = _parse_options(options), wanted_parts([""] * len(files), parts)
        words = [
            replace(part, input=await _store_upload(folder, file)).encoded
            for part, file in zip(parts_wanted, files, strict=True)
        ]
        task = Task("nest", tuple(words), "auto", given)
        record, answer = await _run_to_end(jobs, task)
        sheets = sheets_in_answer(record.id, answer)
        texts = {sheet.file: _artefact_text(jobs, record.id, sheet.drawing) for sheet in sheets}
        return _JsonAnswer({**answer, "texts": texts, "job": record.id})

    @routes.post("/simulate", summary="Time and cost of a program on a machine, and its dangers")
    async def simulate(file: Upload = None, options: Options = "{}") -> _JsonAnswer:
        """Return the answer of ``leafcut simulate --json``, and the job's id as ``job``."""
        given = _parse_options(options)
        task = Task("simulate", (await _uploaded_or_named_input(folder, file, ""),), "auto", given)
        record, answer = await _run_to_end(jobs, task)
        return _JsonAnswer({**answer, "job": record.id})

    @routes.post("/verify", summary="Whether two programs do the same work, and their differences")
    async def verify(
        original: Annotated[UploadFile, File(description="the reference program")],
        new: Annotated[UploadFile, File(description="the program to compare with it")],
        options: Options = "{}",
    ) -> _JsonAnswer:
        """Return the answer of ``leafcut verify --json``, and the job's id as ``job``."""
        given = _parse_options(options)
        files = (await _store_upload(folder, original), await _store_upload(folder, new))
        record, answer = await _run_to_end(jobs, Task("verify", files, "auto", given))
        return _JsonAnswer({**answer, "job": record.id})


def _add_upload_route(routes: APIRouter, folder: Folder) -> None:
    @routes.post("/files", summary="Open a file in the studio", openapi_extra={"requestBody": _BODY})
    async def open_file(request: Request, name: Annotated[str, Query(max_length=1000)]) -> dict[str, Any]:
        """Store the body of the request as a file; return its ``id``, its ``name`` and its ``size`` in bytes."""
        input_id, path = folder.new_input(name)
        size = 0
        try:
            with path.open("wb") as output:
                async for chunk in request.stream():
                    size += len(chunk)
                    output.write(chunk)
        except BaseException:
            folder.delete_inputs([input_id])
            raise
        return {"id": input_id, "name": path.name, "size": size}


def _add_points_route(routes: APIRouter, folder: Folder) -> None:
    @routes.get("/points.csv", summary="The points of a map, such as random:200:1, or of a file that is open")
    def points(source: Annotated[str, Query(max_length=200)]) -> Response:
        from leafcut.read import read
        from leafcut.read.csvmap import holes_as_csv

        part = read(folder.resolve_source(source))
        name = quote(f"{source.replace(':', '-')}.csv")
        headers = {
            "content-disposition": f"attachment; filename*=UTF-8''{name}",
            "content-security-policy": STILL_POLICY,
        }
        return Response(holes_as_csv(part), media_type="text/csv; charset=utf-8", headers=headers)


def _job_answer(jobs: Jobs, record: JobRecord) -> dict[str, Any]:
    live = jobs.find_live_job(record.id)
    latest = live.latest if live is not None else None
    return {
        "id": record.id,
        "title": record.title,
        "command": record.task.command,
        "process": record.task.process,
        "options": record.task.options,
        "state": record.state.value,
        "created": record.created,
        "finished": record.finished,
        "error": record.line,
        "figures": record.figures,
        "progress": None
        if latest is None or record.state.is_over
        else {"what": latest.step, "cost": latest.cost, "share": latest.share, "gap": latest.gap},
        "files": {name: file for name, file in jobs.history.artefacts(record.id).items() if file},
    }


def _existing_record(jobs: Jobs, job: str) -> JobRecord:
    record = jobs.record(job)
    if record is None:
        raise HTTPException(404, "there is no such job")
    return record


def _add_job_routes(routes: APIRouter, jobs: Jobs) -> None:
    @routes.get("/jobs", summary="The last jobs, the newest first")
    def every(most: Annotated[int, Query(ge=1, le=1000)] = 100) -> dict[str, Any]:
        return {"jobs": [_job_answer(jobs, record) for record in jobs.newest(most)]}

    @routes.get("/jobs/{job}", summary="State of a job, and its answer when it is done")
    def one(job: JobId) -> dict[str, Any]:
        return {**_job_answer(jobs, _existing_record(jobs, job)), "answer": jobs.history.answer(job)}

    @routes.post("/jobs/{job}/stop", summary="Stop a job and keep its best result")
    def stop(job: JobId) -> dict[str, Any]:
        _existing_record(jobs, job)
        jobs.stop(job)
        return _job_answer(jobs, _existing_record(jobs, job))

    @routes.post("/jobs/{job}/cancel", summary="Stop a job and discard its result")
    def cancel(job: JobId) -> dict[str, Any]:
        _existing_record(jobs, job)
        jobs.cancel(job)
        return _job_answer(jobs, _existing_record(jobs, job))

    @routes.get(
        "/jobs/{job}/answer", summary="The answer of a job that is done, as the command line gives it with --json"
    )
    def answer(job: JobId) -> _JsonAnswer:
        stored = jobs.history.answer(_existing_record(jobs, job).id)
        if stored is None:
            raise HTTPException(404, "this job has no answer")
        return _JsonAnswer(stored)

    @routes.post("/jobs/{job}/cuts", summary="Plan the cuts of all sheets of a nest, and compare its variants")
    async def plan(job: JobId, options: Options = "{}") -> dict[str, Any]:
        """Plan the cuts, and return their time and cost for every variant. The jobs contain the programs."""
        _existing_record(jobs, job)
        for cut_job in start_cut_planning(jobs, job, _parse_options(options)):
            await jobs.wait_without_blocking(cut_job)
        return {"variants": compare_variants(jobs, job)}

    @routes.get("/jobs/{job}/cuts", summary="Time and cost of the cuts of a nest's variants that are planned already")
    def cuts(job: JobId) -> dict[str, Any]:
        _existing_record(jobs, job)
        return {"variants": compare_variants(jobs, job)}

    @routes.delete("/jobs/{job}", summary="Delete a job and the files that only it used")
    def delete(job: JobId) -> dict[str, str]:
        _existing_record(jobs, job)
        jobs.delete(job)
        return {"deleted": job}

    @routes.get(
        "/jobs/{job}/files/{name}",
        summary="A file written by a job",
        response_class=Response,
        responses={200: {"description": "the file", "content": {"*/*": {"schema": _BINARY}}}},
    )
    def artefact(job: JobId, name: Annotated[str, Path(max_length=40)], show: bool = False) -> Response:
        stored = jobs.history.artefact(job, name)
        if stored is None:
            raise HTTPException(404, "the file does not exist")
        shown = show and stored.media_type in _SHOWN
        disposition = f"{'inline' if shown else 'attachment'}; filename*=UTF-8''{quote(stored.file_name)}"
        headers = {"content-disposition": disposition, "content-security-policy": STILL_POLICY}
        return Response(stored.data, media_type=stored.media_type, headers=headers)


def _add_list_routes(routes: APIRouter) -> None:
    @routes.get("/machines", summary="The machines that leafcut knows")
    def machines() -> dict[str, Any]:
        from leafcut.read.machine import machine_descriptions

        return {"machines": [{"name": name, "description": words} for name, words in machine_descriptions()]}

    @routes.get("/algorithms", summary="The algorithms that order the work")
    def algorithms() -> dict[str, Any]:
        from leafcut import api

        return {"algorithms": [{"name": name, "description": words} for name, words in api.algorithms().items()]}

    @routes.get("/formats", summary="The kinds of file that leafcut reads")
    def formats() -> dict[str, Any]:
        from leafcut.read import formats

        rows = [{"name": f.name, "description": f"{' '.join(f.extensions)}  {f.help}".strip()} for f in formats()]
        return {"formats": rows}

    @routes.get("/options", summary="Every option: its kind, unit, bounds, choices and help")
    def options() -> dict[str, Any]:
        rows = [
            {
                "name": name,
                "flag": flag_name(name),
                "group": group.section,
                "kind": spec.kind,
                "unit": spec.unit,
                "minimum": spec.minimum,
                "maximum": spec.maximum,
                "choices": list(spec.all_choices),
                "default": spec.default_words,
                "help": spec.help,
            }
            for group in registry.option_groups()
            for name, spec in group.specs().items()
        ]
        return {"options": rows}
