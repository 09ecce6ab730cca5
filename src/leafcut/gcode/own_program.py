"""Interpret programs that leafcut wrote, in the language of the controller."""

from __future__ import annotations

from collections.abc import Mapping

from leafcut.errors import ReadError
from leafcut.gcode.dialects import Dialect
from leafcut.gcode.interpreter import Interpreter
from leafcut.gcode.policy import OwnPolicy
from leafcut.gcode.state import InterpreterState
from leafcut.gcode.torch import set_outputs_after_abort
from leafcut.gcode.words import BlockError, numbered_lines
from leafcut.model.toolpath import Toolpath


def interpret_own_program(
    text: str,
    dialect: Dialect,
    file: str = "program",
    *,
    left_over: bool = False,
    material_feeds: Mapping[int, float] | None = None,
) -> Toolpath:
    """Return the motions and commands of a program. Every word must be supported.

    A coordinate is NaN until the program moves its axis. Text after the end of the program is ignored. G28 and G30 are
    assumed to end at machine zero.

    Parameters
    ----------
    left_over
        Whether to start with modes that another program may have left active (G1, G18, G91, G95, G99). This exposes a
        program that does not state its own modes. Otherwise, the interpreter starts with the power-on modes.
    material_feeds
        Feeds in the controller's material table, mm/s, by number. M190 selects the number, and the material F word of
        the dialect uses its feed. Other numbers are errors. With None, any number may be selected, and all feeds are
        unknown.

    Raises
    ------
    ReadError
        A word or block is unsupported, or the end word that the controller requires is missing. The message names the
        line.
    """
    if dialect.language == "klartext":
        from leafcut.gcode.klartext import interpret_klartext

        return interpret_klartext(text, file)
    policy = OwnPolicy()
    state = InterpreterState(dialect=dialect, policy=policy)
    state.material_feeds = material_feeds
    if left_over:
        state.motion, state.plane, state.incremental, state.to_initial = 1, 18, True, False
        # A control without G94 has no other feed mode.
        state.feed_mode = 95 if 940 in dialect.g_codes else 94
        state.offset_on = dialect.length_offset == "edge"
        set_outputs_after_abort(state)
    interpreter = _interpreter_class(dialect.language)(state, policy)
    for number, line in numbered_lines(text):
        if not line or line.isspace():
            continue
        try:
            interpreter.run_line(line, number)
        except BlockError as problem:
            raise ReadError(file, str(problem), number) from None
        if interpreter.ended:
            break
    interpreter.finish_interpretation(file)
    return state.path.build()


def _interpreter_class(language: str) -> type[Interpreter]:
    """Return the interpreter of a language. Dialects without their own language use G-code."""
    if language == "sinumerik":
        from leafcut.gcode.sinumerik import SinumerikInterpreter

        return SinumerikInterpreter
    return Interpreter
