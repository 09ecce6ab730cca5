"""Routes for the machine: its state and all actions.

A refused request is answered with an error. Long actions, such as homing or a program, are answered when they start;
the state shows their progress. Stop is answered at once and does not require control of the machine.
"""

from __future__ import annotations

import asyncio
from concurrent.futures import Future
from typing import TYPE_CHECKING, Annotated, Any, Literal

from fastapi import APIRouter, Path
from pydantic import BaseModel, Field

from leafcut.errors import OptionError
from leafcut.sender.job import SendJob, accepted_codes
from leafcut.sender.port import BAUD, ports
from leafcut.sender.run import Request
from leafcut.studio.control.link import MachineLink, RunWishes
from leafcut.studio.control.program import program_of_file, program_of_job

if TYPE_CHECKING:
    from leafcut.studio.studio import Studio

#: Name of other programs as holders of the control of the machine.
PROGRAM = "program"

Length = Annotated[float, Field(allow_inf_nan=False, ge=-10_000.0, le=10_000.0)]
Feed = Annotated[float, Field(allow_inf_nan=False, gt=0.0, le=100_000.0, description="mm/min")]
_FEEDS = {"faster": Request.FASTER, "slower": Request.SLOWER, "normal": Request.NORMAL}


class ConnectBody(BaseModel):
    """A serial port, and its speed in bits per second."""

    port: Annotated[str, Field(min_length=1, max_length=200)]
    baud: int = BAUD


class JogBody(BaseModel):
    """Distances from the current position, mm, and feed in mm/min."""

    x: Length = 0.0
    y: Length = 0.0
    z: Length = 0.0
    feed: Feed


class ZeroBody(BaseModel):
    """The axes to zero at the current position, such as ``XY``."""

    axes: Annotated[str, Field(max_length=3)]


class ProbeBody(BaseModel):
    """Thickness of the plate and maximum downward distance, mm; feed in mm/min."""

    plate: Length
    feed: Feed
    travel: Length


class ProgramBody(BaseModel):
    """A program (of a finished job, `job`, or an open file, `source`), a machine, and the codes of accepted dangers.

    `unhomed`: the machine cannot home, so the user has set its zero.
    """

    job: Annotated[str, Field(max_length=12)] = ""
    source: Annotated[str, Field(max_length=16)] = ""
    machine: Annotated[str, Field(max_length=100)]
    accept: Annotated[str, Field(max_length=200)] = ""
    unhomed: bool = False


class FrameBody(ProgramBody):
    """A program, and the feed in mm/min for tracing its bounding box."""

    feed: Feed


class RunBody(ProgramBody):
    """A program with its run options: start at a hole or line, hole by hole, unattended."""

    from_hole: int | None = None
    from_line: int | None = None
    by_hole: bool = False
    alone: bool = False


class AnswerBody(BaseModel):
    """The answer to a question: continue, continue without asking before holes, or stop."""

    answer: Literal["go on", "all", "stop"]


def add_machine(router: APIRouter, studio: Studio, link: MachineLink) -> None:
    """Add the routes for the machine."""
    _add_connection(router, link)
    _add_by_hand(router, link)
    _add_program(router, studio, link)


def _state(link: MachineLink) -> dict[str, Any]:
    link.record_page(PROGRAM)
    return link.state.as_json()


async def _done(link: MachineLink, future: Future[Any]) -> dict[str, Any]:
    await asyncio.wrap_future(future)
    return _state(link)


def _add_connection(router: APIRouter, link: MachineLink) -> None:
    @router.get("/machine", summary="State and position of the machine, and the progress of its program")
    async def state() -> dict[str, Any]:
        return _state(link)

    @router.get("/machine/ports", summary="The serial ports of this computer")
    def serial_ports() -> dict[str, Any]:
        return {"ports": [{"name": name, "description": words} for name, words in ports()]}

    @router.post("/machine/connect", summary="Connect a GRBL board")
    async def connect(body: ConnectBody) -> dict[str, Any]:
        return await _done(link, link.connect(PROGRAM, body.port, body.baud))

    @router.post("/machine/disconnect", summary="Close the port")
    async def disconnect() -> dict[str, Any]:
        await asyncio.to_thread(link.disconnect, PROGRAM)
        return _state(link)

    @router.post("/machine/take", summary="Take control of the machine from a page")
    async def take() -> dict[str, Any]:
        link.take(PROGRAM)
        return _state(link)

    @router.post("/machine/stop", summary="Stop the machine: hold, wait for standstill, reset; the spindle is off")
    async def stop() -> dict[str, str]:
        link.stop()
        return {"stop": "sent"}


def _add_by_hand(router: APIRouter, link: MachineLink) -> None:
    @router.post("/machine/home", summary="Home it")
    async def home() -> dict[str, Any]:
        return await _done(link, link.home(PROGRAM))

    @router.post("/machine/unlock", summary="Unlock the machine after an alarm or a hold, without homing")
    async def unlock() -> dict[str, Any]:
        return await _done(link, link.unlock(PROGRAM))

    @router.post("/machine/jog", summary="Jog the machine")
    async def jog(body: JogBody) -> dict[str, Any]:
        moves = {axis: value for axis, value in (("X", body.x), ("Y", body.y), ("Z", body.z)) if value}
        return await _done(link, link.jog(PROGRAM, moves, body.feed))

    @router.post("/machine/cancel", summary="End a jog or a frame")
    async def cancel() -> dict[str, Any]:
        link.cancel(PROGRAM)
        return _state(link)

    @router.post("/machine/zero", summary="Set the work zero at the current tool position (G10 L20 P1)")
    async def zero(body: ZeroBody) -> dict[str, Any]:
        return await _done(link, link.zero(PROGRAM, body.axes))

    @router.post("/machine/probe", summary="Set the zero of Z with a touch plate (G38.2)")
    async def probe(body: ProbeBody) -> dict[str, Any]:
        return await _done(link, link.probe(PROGRAM, body.plate, body.feed, body.travel))


def _add_program(router: APIRouter, studio: Studio, link: MachineLink) -> None:
    @router.post(
        "/machine/check", summary="Check a program against the current state of the machine, without sending it"
    )
    async def check(body: RunBody) -> dict[str, Any]:
        job = await asyncio.to_thread(_program, studio, body)
        ready = await asyncio.wrap_future(link.check(PROGRAM, job, _wishes(body)))
        seconds = float(sum(part.sum() for part in job.seconds))
        return {
            "told": ready.told, "seconds": seconds, "holes": len(job.holes), "box": ready.box, "tools": ready.tools,
        }  # fmt: skip

    @router.post("/machine/frame", summary="Trace the bounding box of a program in the air")
    async def frame(body: FrameBody) -> dict[str, Any]:
        job = await asyncio.to_thread(_program, studio, body)
        return await _done(link, link.frame(PROGRAM, job, RunWishes(unhomed=body.unhomed), body.feed))

    @router.post("/machine/run", summary="Run a program")
    async def run(body: RunBody) -> dict[str, Any]:
        job = await asyncio.to_thread(_program, studio, body)
        ready = await asyncio.wrap_future(link.run(PROGRAM, job, _wishes(body)))
        return {**_state(link), "told": ready.told}

    @router.post("/machine/answer", summary="Answer a question of the program: next hole, tool change, pause")
    async def answer(body: AnswerBody) -> dict[str, Any]:
        link.answer(PROGRAM, {"go on": "", "all": "all", "stop": None}[body.answer])
        return _state(link)

    @router.post(
        "/machine/hold", summary="Hold the program: the machine decelerates to a stop, the spindle keeps running"
    )
    async def hold() -> dict[str, Any]:
        link.request(PROGRAM, Request.HOLD)
        return _state(link)

    @router.post("/machine/resume", summary="Go on after a hold")
    async def resume() -> dict[str, Any]:
        link.request(PROGRAM, Request.RESUME)
        return _state(link)

    @router.post("/machine/feed/{change}", summary="Change the feed by 10 %, or reset it to the programmed feed")
    async def feed(change: Annotated[Literal["faster", "slower", "normal"], Path()]) -> dict[str, Any]:
        link.request(PROGRAM, _FEEDS[change])
        return _state(link)


def _wishes(body: RunBody) -> RunWishes:
    return RunWishes(body.from_hole, body.from_line, body.by_hole, body.unhomed, body.alone)


def _program(studio: Studio, body: ProgramBody) -> SendJob:
    if bool(body.job) == bool(body.source):
        raise OptionError("name the program: a job, or an open file as 'source'")
    accept = accepted_codes(body.accept)
    if body.job:
        return program_of_job(studio.history, studio.folder, body.job, body.machine, accept)
    return program_of_file(studio.folder, body.source, body.machine, accept=accept)
