"""The machine view, where users connect, move the machine and run programs, and the Stop bar that every view shows."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from typing import Any

from nicegui import Client, background_tasks
from nicegui.elements.mixins.text_element import TextElement

from leafcut.errors import LeafcutError
from leafcut.sender.port import BAUD, BAUDS, list_serial_ports
from leafcut.studio.control.fields import JogPad, MachineForm, set_button_enabled
from leafcut.studio.control.link import MachineLink
from leafcut.studio.control.program_panel import MachineProgramPanel
from leafcut.studio.control.state import Connection, MachineState, MachineTask
from leafcut.studio.page.elements import box, button, text
from leafcut.studio.page.page_state import View
from leafcut.studio.page.pages import Page
from leafcut.units import to_fixed

#: Maps the state of the controller to a CSS class.
_COLOURS = {"Idle": "done", "Run": "running", "Jog": "running", "Home": "running", "Alarm": "failed"}
#: Number of ticks after which the page reports to the link again.
_EVERY = 10

_AXES = "XYZ"
#: Jog distances, mm.
STEPS = ("0.1", "1", "10", "100")


class MachinePanel:
    """The machine view of a page."""

    def __init__(self, view: View, page: Page, client: Client, link: MachineLink) -> None:
        self.view, self.page, self._client = view, page, client
        self.link, self.key = link, str(client.id)
        self._number, self._ticks = -1, 0
        state = self.link.state
        # A page that is opened while a machine is connected shows the last message.
        self._shown_message = -1 if state.is_connected else state.saying
        self._drawing = False
        w = view.words
        with box("div", "control"):
            with box("div", "control-column"):
                text("h1", w("machine.title"), "unseen")
                self._build_connection_card()
                self.by_hand = ByHandPanel(view, self)
            with box("section", "control-drawing", aria_label=w("middle.title")):
                self.drawing = box("div", "frame")
            with box("div", "control-column"):
                self.program = MachineProgramPanel(view, self, self.drawing)
        self._show_state(self.link.state)

    def _build_connection_card(self) -> None:
        w = self.view.words
        with box("section", "card machine-card", aria_label=w("machine.connection")):
            with box("div", "title"):
                text("h2", w("machine.connection"))
                self.tag = text("span", "", "tag", role="status")
            with box("div", "fields") as self.closed:
                self.port_fields = MachineForm(w)
                self._offer_ports([])
                rates = [[str(rate), str(rate)] for rate in BAUDS]
                self.port_fields.add_field("baud", w("flag.baud"), str(BAUD), choices=rates, default=str(BAUD))
                self.no_ports = text("p", w("machine.no_ports"), "quiet small")
                text("p", w("machine.boards"), "quiet small")
                with box("div", "ends"):
                    self.connect = button(w("machine.connect"), self._connect, "primary")
                    button(w("machine.look"), self.list_ports, "plain small")
            with box("div", "fields") as self.open:
                self.about = text("p", "", "quiet small")
                self.alone = box("div", "stale other-page")
                with self.alone:
                    text("b", w("machine.other_page"))
                    with box("div", "ends"):
                        button(w("machine.take"), self._take_control, "small")
                with box("div", "ends"):
                    self.home = button(w("flag.home"), lambda: self.send_request(self.link.home), "small")
                    self.unlock = button(w("flag.unlock"), lambda: self.send_request(self.link.unlock), "small")
                    self.leave = button(w("machine.disconnect"), self._disconnect, "plain small")
            # Messages about the machine; a screen reader announces them.
            self.line = text("p", "", "machine-line", role="status", aria_live="polite", id="machine-line")

    # Requests.

    async def send_request(self, request: Callable[..., Any], *given: Any, **named: Any) -> Any:
        """Send a request to the machine. If the machine refuses, show the reason.

        Returns the answer, or True if the request has no answer. Returns None if the machine has refused.
        """
        try:
            answer = request(self.key, *given, **named)
            return True if answer is None else await asyncio.wrap_future(answer)
        except LeafcutError as problem:
            self.show_message(str(problem), bad=True)
            return None

    def show_message(self, line: str, *, bad: bool = False) -> None:
        """Show a message in the machine view."""
        self.line.set_text(self.view.words.translate_for_page(line))
        self.line.classes(replace="machine-line bad" if bad else "machine-line")

    def jog_feed(self) -> float:
        """Return the jog feed, mm/min."""
        return self.by_hand.jog_feed()

    async def list_ports(self) -> None:
        """Fill the menu with the serial ports of this computer."""
        try:
            names = await asyncio.to_thread(list_serial_ports)
        except LeafcutError as problem:
            self.show_message(str(problem), bad=True)
            return
        self._offer_ports([(name, words if words not in ("", "n/a") else name) for name, words in names])
        self.no_ports.set_visibility(not names)

    def _offer_ports(self, names: list[tuple[str, str]]) -> None:
        first = names[0][0] if names else ""
        self.port_fields.add_field("port", self.view.words("flag.port"), offers=names, default=first)

    async def _connect(self) -> None:
        self.show_message("")
        await self.send_request(self.link.connect, self.port_fields.text("port"), int(self.port_fields.text("baud")))

    async def _disconnect(self) -> None:
        try:
            await asyncio.to_thread(self.link.disconnect, self.key)
        except LeafcutError as problem:
            self.show_message(str(problem), bad=True)

    def _take_control(self) -> None:
        self.link.take_control(self.key)

    # Display.

    async def show(self) -> None:
        """Show the view with the available ports and the open program."""
        self._drawing = True
        try:
            if self.link.state.connection is Connection.CLOSED:
                await self.list_ports()
            await self.program.load_open_program()
        finally:
            self._drawing = False

    def tick(self, *, shown: bool) -> None:
        """Show any changes of the state. While the page is connected, also report to the link that it is open."""
        self._ticks += 1
        connected = self._client.has_socket_connection
        if connected and self._ticks % _EVERY == 0:
            self.link.record_page(self.key, adopt=shown)
        if shown and connected and self._ticks % _EVERY == 0 and not self._drawing and self.program.has_changed():
            background_tasks.create(self.show())
        state = self.link.state
        if state.number != self._number and connected:
            self._show_state(state)

    def tick_now(self) -> None:
        """Show the current state, even if it has not changed."""
        self._show_state(self.link.state)

    def has_control(self, state: MachineState) -> bool:
        """Return whether this page controls the machine."""
        return state.is_connected and state.holder == self.key

    def _show_state(self, state: MachineState) -> None:
        self._number = state.number
        w = self.view.words
        self.closed.set_visibility(state.connection is Connection.CLOSED)
        self.open.set_visibility(state.is_connected)
        kind = "running" if state.connection is Connection.OPENING else _COLOURS.get(state.status, "cancelled")
        self.tag.set_text(status_words(state, self.view))
        self.tag.classes(replace=f"tag {kind if state.connection is not Connection.CLOSED else ''}")
        self.about.set_text(w("machine.about", version=state.version, port=state.port) if state.version else state.port)
        is_holder = self.has_control(state)
        self.alone.set_visibility(state.is_connected and not is_holder)
        free = is_holder and state.doing in (MachineTask.NOTHING, MachineTask.ASKING)
        set_button_enabled(self.home, free and state.homing and state.status in ("Idle", "Alarm"))
        set_button_enabled(self.unlock, free and (state.status != "Idle"))
        set_button_enabled(self.leave, free and not state.is_moving)
        if state.saying != self._shown_message:
            self._shown_message = state.saying
            self.show_message(state.said, bad=state.bad)
        self.by_hand.show(state, is_holder)
        self.program.show(state, is_holder)


def status_words(state: MachineState, view: View) -> str:
    """Describe the state of the machine in a short label."""
    w = view.words
    if state.connection is not Connection.OPEN:
        return w(f"machine.{state.connection.value}")
    if state.doing is MachineTask.HOMING:
        return w("machine.state.Home")
    return w.table.get(f"machine.state.{state.status}", state.status)


class StopBar:
    """The Stop button for the machine. Every view shows it while a machine is connected."""

    def __init__(self, view: View, link: MachineLink) -> None:
        self.view, self.link = view, link
        self._shown: object = None
        w = view.words
        with box("div", "machine-stop", role="region", aria_label=w("machine.stop_region")) as self.place:
            self.words = text("span", "", "machine-stop-state")
            with box(
                "button",
                "machine-stop-button",
                type="button",
                data_machine_stop="",
                data_lost=w("machine.stop_lost"),
                aria_keyshortcuts="Escape Pause",
            ) as self.button:
                text("b", w("machine.stop"))
                text("kbd", "Esc", aria_hidden="true")

    def tick(self) -> None:
        """Show the button if a machine is connected."""
        state = self.link.state
        now = (state.connection is not Connection.CLOSED, state.is_moving, status_words(state, self.view))
        if now == self._shown:
            return
        self._shown = now
        self.place.set_visibility(now[0])
        self.words.set_text(now[2])
        self.button.props["data-moves"] = json.dumps(now[1])
        self.button.update()


class ByHandPanel:
    """The cards that show the position and let users jog and probe."""

    def __init__(self, view: View, panel: MachinePanel) -> None:
        self.view, self.panel, self.link = view, panel, panel.link
        self.step = "1"
        self._build_position_card()
        self._build_jog_card()
        self._build_probe_card()

    def _build_position_card(self) -> None:
        w = self.view.words
        self.work: list[TextElement] = []
        self.machine: list[TextElement] = []
        self.zeros: list[TextElement] = []
        with box("section", "card machine-card", aria_label=w("machine.position")):
            text("h2", w("machine.position"))
            with box("table", "place", aria_label=w("machine.position")):
                with box("thead"), box("tr"):
                    text("td", "")
                    text("th", w("machine.work"), "n", scope="col")
                    text("th", w("machine.machine"), "n", scope="col")
                    text("td", "")
                with box("tbody"):
                    for axis in _AXES:
                        with box("tr"):
                            text("th", axis, scope="row")
                            self.work.append(text("td", "–", "n large", id=f"machine-work-{axis.lower()}"))
                            self.machine.append(text("td", "–", "n quiet", id=f"machine-place-{axis.lower()}"))
                            with box("td", "n"):
                                self._add_zero_button(w("machine.zero_axis", axis=axis), axis)
            with box("div", "ends"):
                self._add_zero_button(w("machine.zero_xy"), "XY")
                self._add_zero_button(w("machine.zero_all"), "XYZ")
            self.unsure = text("p", w("machine.unsure"), "warn small")

    def _add_zero_button(self, words: str, axes: str) -> None:
        self.zeros.append(button(words, lambda: self.panel.send_request(self.link.set_zero, axes), "small"))

    def _build_jog_card(self) -> None:
        w = self.view.words
        with box("section", "card machine-card", aria_label=w("machine.jog")):
            text("h2", w("machine.jog"))
            with box("div", "steps", role="group", aria_label=w("machine.step")):
                self.steps = {
                    step: button(
                        step,
                        lambda step=step: self._choose_step(step),
                        "tab small",
                        aria_pressed="true" if step == self.step else "false",
                        aria_label=f"{step} mm",
                    )
                    for step in STEPS
                }
                text("span", "mm", "quiet small")
            self.pad = JogPad(w("machine.jog"), w("machine.jog_hint"), self._jog_axis, self._end_jog)
            self.jog_fields = MachineForm(w)
            self.jog_fields.add_field("jog-feed", w("machine.feed"), "1000", unit="mm/min")
            text("p", w("machine.jog_hint"), "quiet small")

    def _choose_step(self, step: str) -> None:
        self.step = step
        for size, step_button in self.steps.items():
            step_button.props(f"aria-pressed={'true' if size == step else 'false'}")

    async def _jog_axis(self, axis: str, sign: int, is_held: bool) -> None:
        if axis not in _AXES:
            return
        distances = {axis: (1 if sign > 0 else -1) * float(self.step)}
        await self.panel.send_request(lambda key: self.link.jog(key, distances, self.jog_feed(), held=is_held))

    def jog_feed(self) -> float:
        """Return the jog feed, mm/min."""
        return self.jog_fields.number("jog-feed")

    async def _end_jog(self) -> None:
        await self.panel.send_request(self.link.cancel_motion)

    def _build_probe_card(self) -> None:
        w = self.view.words
        with box("details", "card machine-card"):
            text("summary", w("machine.probe"))
            with box("div", "fields"):
                text("p", w("machine.probe_hint"), "quiet small")
                self.probe_fields = MachineForm(w)
                self.probe_fields.add_field("plate", w("machine.plate"), "1.5", unit="mm")
                self.probe_fields.add_field("probe-feed", w("machine.feed"), "50", unit="mm/min")
                self.probe_fields.add_field("probe-limit", w("machine.limit"), "15", unit="mm")
                with box("div", "ends"):
                    self.probe = button(w("machine.probe_now"), self._probe_now, "")

    async def _probe_now(self) -> None:
        number = self.probe_fields.number
        await self.panel.send_request(
            lambda key: self.link.probe(key, number("plate"), number("probe-feed"), number("probe-limit"))
        )

    def show(self, state: MachineState, commands: bool) -> None:
        """Update the position, and enable the actions that are currently possible."""
        for places, place in ((self.work, state.work), (self.machine, state.machine)):
            for axis, cell in enumerate(places):
                words = "–" if place is None or not state.is_connected else to_fixed(place[axis], 3)
                if cell.text != words:
                    cell.set_text(words)
        asked = state.question is not None
        free = commands and (asked or state.doing in (MachineTask.NOTHING, MachineTask.ASKING))
        at_rest = free and state.status == "Idle"
        for zero_button in self.zeros:
            set_button_enabled(zero_button, at_rest)
        set_button_enabled(self.probe, at_rest)
        self.pad.set_enabled(free and state.status in ("Idle", "Jog"))
        self.unsure.set_visibility(state.is_connected and state.unsure)
