"""Methods that all results share: describe, show, and save."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from html import escape
from pathlib import Path
from typing import Any, TypeVar

from leafcut.errors import OptionError
from leafcut.files.schemas import ANSWER, add_schema_number
from leafcut.files.whole_files import OutputError, check_output, write_all_or_none
from leafcut.model.issue import Issue, Severity

#: Maximum number of issues shown below the picture in a notebook. Only dangers and missing work are shown.
_MOST_ISSUES = 5

#: Maps a file extension ("" for all other extensions) to a function that returns the content of the file.
Kinds = dict[str, Callable[[], str | bytes]]
R = TypeVar("R", bound="Result")


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class Result:
    """Base class of all results.

    `inputs` are the files that were read. The method `save` never overwrites them.
    """

    inputs: tuple[str, ...] = ()

    def __repr__(self) -> str:
        line = f"{type(self).__name__}({self._summary_line()})"
        return "".join(letter if letter.isprintable() else "?" for letter in line)

    def _repr_html_(self) -> str:
        """Show the result in a notebook: the picture as an image, which cannot run scripts, and the `repr`."""
        line, svg = escape(repr(self)), self._svg()
        worst = [issue for issue in self._shown_issues() if issue.severity in (Severity.DANGER, Severity.MISSING)]
        lines = [line, *(escape(f"{issue.severity}: {issue}") for issue in worst[:_MOST_ISSUES])]
        address = base64.b64encode(svg.encode()).decode()
        image = f'<img alt="{line}" style="max-width: 40em" src="data:image/svg+xml;base64,{address}">' if svg else ""
        return f"<figure>{image}<figcaption>{'<br>'.join(lines)}</figcaption></figure>"

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain values, in the same form as the command's ``--json`` output."""
        return dict(add_schema_number(ANSWER, self._json_answer()))

    def save(self, path: str | Path) -> None:
        """Write the result to a file. The extension selects the format; every result supports ``.json``.

        Raises
        ------
        OptionError
            The result does not support the format.
        OutputError
            The file cannot be written, or is one of `inputs`.
        """
        file = Path(path)
        check_output(file, self.inputs)
        try:
            contents = {
                name: text.encode() if isinstance(text, str) else text for name, text in self._files_to_save(file)
            }
        except UnicodeEncodeError as problem:
            raise OutputError("{}: cannot be written (a character is not in {})", file, problem.encoding) from None
        for name in contents:
            check_output(name, self.inputs)
        write_all_or_none(
            {name: data.decode("latin-1") for name, data in contents.items()}, encoding="latin-1", newline=""
        )

    def _files_to_save(self, file: Path) -> Iterable[tuple[str, str | bytes]]:
        kinds = self._contents_by_extension()
        content = kinds.get(file.suffix.lower(), kinds.get(""))
        if content is None:
            endings = " or ".join(", ".join(self._extensions()).rsplit(", ", 1))
            raise OptionError("{}: unknown kind of file; choose a name that ends in {}", file, endings)
        yield str(file), content()

    def _extensions(self) -> Iterable[str]:
        return self._contents_by_extension()

    def _contents_by_extension(self) -> Kinds:
        pictured: Kinds = {".svg": self._svg} if "_svg" in vars(type(self)) else {}
        return {".json": lambda: json.dumps(self.to_dict(), indent=2, ensure_ascii=False) + "\n", **pictured}

    def _summary_line(self) -> str:
        raise NotImplementedError

    def _json_answer(self) -> dict[str, Any]:
        raise NotImplementedError

    def _svg(self) -> str:
        return ""

    def _shown_issues(self) -> tuple[Issue, ...]:
        found: tuple[Issue, ...] = getattr(self, "issues", ())
        return found


def as_public_result(kind: type[R], found: Any, inputs: Iterable[object]) -> R:
    """Convert a result from `model` to a result of the library.

    `inputs` are the files that were read, or None.
    """
    values = {field.name: getattr(found, field.name) for field in fields(found)}
    return kind(**values, inputs=tuple(dict.fromkeys(str(one) for one in inputs if one is not None)))
