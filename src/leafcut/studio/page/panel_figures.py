"""The figures of the report, as shown on the page: costs, distribution of time, and values per part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from leafcut.studio.page.elements import box, table, text
from leafcut.studio.wording import Words
from leafcut.units import format_time

_MAX_PARTS = 100
_NORM_COLUMNS = ("part", "perimeter", "quantity", "total_perimeter", "hours", "minutes", "seconds")


def draw_figures(overview: dict[str, Any], words: Words) -> None:
    """Show the result of `report.json_answer.studio_overview_as_json` in the current container."""
    kinds = {kind["class"]: words.translate(kind["words"]) for kind in overview["times"]["kinds"]}
    rows = [(words.translate(row["name"]), row["seconds"], row["total"]) for row in overview["times"]["rows"]]
    # Results of earlier versions lack the counts.
    text("p", " · ".join(words.translate(sentence) for sentence in overview.get("title", ())), "quiet")
    draw_times(rows, words, kinds)
    _draw_tiles(overview["tiles"], words)
    _draw_parts(overview["parts"], words)
    _draw_norms(overview.get("norms") or {"rows": []}, words)


def _draw_tiles(tiles: Sequence[dict[str, Any]], words: Words) -> None:
    if not tiles:
        return
    with box("dl", "tiles"):
        for tile in tiles:
            with box("div", "tile"):
                text("dt", words.translate(tile["name"]))
                with box("dd"):
                    text("b", tile["figure"])
                    text("span", words.translate(tile["words"]), "quiet small")


def draw_times(rows: Sequence[tuple[str, dict[str, float], str]], words: Words, kinds: dict[str, str]) -> None:
    """Draw stacked bars with a common scale. Each row contains a name, the seconds of each kind, and the total.

    `kinds` contains the label of each kind.
    """
    rows = [
        (name, {k.replace("_", "-"): s for k, s in seconds.items() if s > 0}, total) for name, seconds, total in rows
    ]
    longest = max((sum(seconds.values()) for _, seconds, _ in rows), default=0.0)
    if longest <= 0.0:
        return
    text("h3", words("result.where"))
    with box("ul", "time-bars", aria_label=words("result.where")):
        for name, seconds, total in rows:
            with box("li"):
                text("span", name)
                text("b", total, "figure")
                with box("div", "time-bar", aria_hidden="true"):
                    for kind in kinds:
                        if kind in seconds:
                            share = 100.0 * seconds[kind] / longest
                            box("i", f"time-{kind}").style(f"width: {share:.3f}%")
    _draw_legend(rows, kinds, words)


def _draw_legend(rows: Sequence[tuple[str, dict[str, float], str]], kinds: dict[str, str], words: Words) -> None:
    known = [kind for kind in kinds if any(kind in seconds for _, seconds, _ in rows)]
    with box("div", "scroll"), box("table", "kinds", aria_label=words("result.where")):
        with box("thead"), box("tr"):
            text("td", "")
            for name, _, _ in rows:
                text("th", name or words("result.time"), "n", scope="col")
        with box("tbody"):
            for kind in known:
                with box("tr", f"of-{kind}"):
                    text("th", kinds[kind], scope="row")
                    for _, seconds, _ in rows:
                        text("td", format_time(seconds[kind]) if kind in seconds else "–", "n")


def _draw_parts(parts: dict[str, Any], words: Words) -> None:
    rows, cost = parts["rows"][:_MAX_PARTS], parts.get("cost", False)
    if not rows:
        return
    text("h3", words("result.parts"))
    keys = ("part", "pierces", "time", *(("cost",) if cost else ()))
    names = {"part": "number", "time": "total"}
    heads = [(words(f"result.{key}"), "" if key == "part" else "n") for key in keys]
    cells = [[words.translate(row[names.get(key, key)]) for key in keys] for row in rows]
    cells += [[words.translate(row["name"]), *(row[names.get(key, key)] for key in keys[1:])] for row in parts["feet"]]
    table(heads, cells, words("result.parts")).classes("parts-of-sheet")
    left = len(parts["rows"]) - len(rows) + parts.get("left_out", 0)
    if left:
        text("p", words("open.more", number=left), "quiet small")


def _draw_norms(norms: dict[str, Any], words: Words) -> None:
    rows = norms["rows"][:_MAX_PARTS]
    if not rows:
        return
    text("h3", words("result.norms"))
    names = [(words(f"result.{key}"), "" if key == "part" else "n") for key in _NORM_COLUMNS]
    names += [(words.translate(name), "n") for name in norms["names"]]
    cells = [[row["name"], row["each"], row["quantity"], row["perimeter"], *_norm_cells(row)] for row in rows]
    cells += [[words.translate(row["name"]), "", "", row["perimeter"], *_norm_cells(row)] for row in norms["feet"]]
    with box("div", "scroll"):
        table(names, cells, words("result.norms")).classes("norms-of-sheet")
    left = len(norms["rows"]) - len(rows) + norms["left_out"]
    if left:
        text("p", words("open.more", number=left), "quiet small")
    if norms["unknown"]:
        unknown = ", ".join(words.translate(name) for name in norms["unknown"])
        text("p", words("result.norms_unknown", names=unknown), "quiet small")


def _norm_cells(row: dict[str, Any]) -> list[str]:
    return [*row["clock"], *row["amounts"]]
