"""The help dialog: keys of the page and of the drawing, formats and algorithms."""

from __future__ import annotations

from functools import cache

from nicegui import ui

from leafcut._version import __version__
from leafcut.studio.wording import Words

#: Views of the page, and their keys.
VIEWS = (("work", "1"), ("jobs", "2"), ("machines", "3"), ("tools", "4"))
#: Other keys of the page → key of their description.
_KEYS: tuple[tuple[tuple[str, ...], str], ...] = (
    (("O",), "key.o"),
    (("R", "Ctrl+Enter"), "key.r"),
    (("S", "Esc"), "key.s"),
    (("Esc",), "key.cancel"),
    (("P",), "key.p"),
    (("N",), "key.n"),
    (("U",), "key.u"),
    (("Y",), "key.y"),
    (("[", "]"), "key.fold"),
    (("/",), "key.find"),
    (("F1",), "key.field"),
    (("T",), "key.t"),
    (("Esc", "Pause"), "key.machine_stop"),
    (("?",), "key.help"),
)
#: Keys of the drawing as displayed → key of their description.
_DRAWING_KEYS = (
    (("← ↑ → ↓",), "key.arrows"), (("+ −",), "key.zoom"), (("F",), "key.fit"), (("␣",), "key.play"),
    ((", .",), "key.block"), (("M",), "key.modes"), (("D",), "key.measure"), (("⇧A … ⇧W",), "key.layers"),
)  # fmt: skip


def help_dialog(words: Words, views: tuple[tuple[str, str], ...]) -> None:
    """Add the hidden help dialog to the page."""
    # A single element instead of hundreds, because every page contains the dialog and few pages show it.
    dialog = ui.html(_text(words, views), sanitize=False, tag="dialog").classes("help")
    dialog.props.update({"id": "help", "aria-label": words("top.help")})


@cache
def _text(words: Words, views: tuple[tuple[str, str], ...]) -> str:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    from leafcut import api
    from leafcut.read import formats

    environment = Environment(
        loader=PackageLoader("leafcut.studio", "page"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    kinds = {f"{f.name} {' '.join(f.extensions)}".strip(): f.help for f in formats()}
    return environment.get_template("help.html.jinja").render(
        w=words,
        version=__version__,
        page_keys=(*(((key,), f"top.{name}") for name, key in views), *_KEYS),
        drawing_keys=_DRAWING_KEYS,
        lists=(("help.formats", kinds), ("help.algorithms", api.algorithms())),
    )
