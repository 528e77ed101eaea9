"""Help of the commands: a first screen with the usual options, and all options with ``--help-all``."""

from __future__ import annotations

import shutil
import textwrap
from itertools import zip_longest
from typing import Any

from typer.core import TyperCommand, TyperGroup

LINES = 25
"""Lines of the first screen."""
_WIDTH = 80
_ALL = "snapbeam.help_all"
_USUAL = (
    "config", "sweep", "drive__frequency_ratio", "drive__velocity_amplitude", "contact__location", "model__modes",
    "integration__cycles", "integration__tolerance", "parameter", "parameters", "statistic", "values", "initial_conditions", "output", "plot", "checkpoint",
    "beam__thickness", "beam__buckling_level", "frequency", "buckling_level", "pixel_size", "frame_rate", "location",
    "camera", "drive_output", "picture", "units", "map",
)  # fmt: skip
"""Options of the first screen, by the names of their parameters."""


def wants_all(ctx: Any) -> None:
    """Show all options of this command in its help."""
    ctx.meta[_ALL] = True


class ShortHelpCommand(TyperCommand):
    """A command whose ``--help`` fits on a screen; ``--help-all`` lists every option."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments; ``--json`` without a file is ``--json -``."""
        words = []
        for word, following in zip_longest(args, args[1:], fillvalue="--"):
            bare = word == "--json" and following != "-" and following.startswith("-")
            words += [word, "-"] if bare else [word]
        return super().parse_args(ctx, words)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help: every option, or the usual ones."""
        _state_defaults(self.params)
        shown = [each for each in self.get_params(ctx) if not getattr(each, "hidden", False)]
        if ctx.meta.get(_ALL):
            super().format_help(ctx, formatter)
        else:
            formatter.write(_first_screen(self, ctx, shown))


class ShortHelpGroup(TyperGroup):
    """Commands, each with one line of help."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write one line for each command."""
        names = self.list_commands(ctx)
        column = max(len(name) for name in names) + 4
        about = {name: (self.get_command(ctx, name).help or "").split("\n\n")[0] for name in names}  # type: ignore[union-attr]
        purpose = _wrapped(self.help or "")
        rows = [f"  {name:<{column - 2}}{_clause(text, _width() - column)}" for name, text in about.items()]
        end = f"Options of a command: {ctx.command_path} COMMAND --help"
        spare = LINES - len(purpose) - len(rows) - 2  # for blank lines
        first, second = ([""] if spare > least else [] for least in (0, 1))
        formatter.write("\n".join([self.get_usage(ctx), *first, *purpose, *second, *rows, end]))


def _width() -> int:
    return min(max(shutil.get_terminal_size((_WIDTH, LINES)).columns, 60), 100)


def _wrapped(text: str, indent: str = "") -> list[str]:
    plain = " ".join(text.split())
    return textwrap.wrap(plain, _width(), initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False)


def _first_screen(command: Any, ctx: Any, params: list[Any]) -> str:
    """Usage, purpose, example, arguments, and as many options as the screen has lines for."""
    paragraphs = [part for part in (command.help or "").split("\n\n") if part.strip()]
    example = [part for part in paragraphs if part.strip().startswith("Example:")]
    head = [command.get_usage(ctx), "", *_wrapped(paragraphs[0] if paragraphs else "")]
    head += [line for part in example for line in ("", *_wrapped(part))]
    rows = [(_flags(each), _clause(each.help or "", 200) + _default(each)) for each in params]
    column = min(max(len(flags) for flags, _ in rows), 34) + 4
    texts = [_row(flags, about, column) for flags, about in rows]
    free = LINES - len(head) - 3
    chosen: set[int] = set()
    for index in sorted(range(len(params)), key=lambda each: (_rank(params[each]), each)):
        if len(texts[index]) <= free:
            chosen.add(index)
            free -= len(texts[index])
    body = [line for index in sorted(chosen) for line in texts[index]]
    rest = len(params) - len(chosen)
    end = f"{rest} more options: {ctx.command_path} --help-all" if rest else ""
    return "\n".join([*head, "", *body, "", end]).rstrip("\n")


def _rank(parameter: Any) -> int:
    """Arguments and required options first, then usual ones, then the others."""
    if parameter.required or parameter.param_type_name == "argument":
        return -1
    if parameter.name == "help_all":
        return len(_USUAL) + 1
    return _USUAL.index(parameter.name) if parameter.name in _USUAL else len(_USUAL)


def _flags(parameter: Any) -> str:
    name = parameter.metavar
    if parameter.param_type_name == "argument":
        return str(name or parameter.human_readable_name.upper())
    flags = ", ".join(sorted(parameter.opts, key=len))
    if parameter.secondary_opts:
        return f"{flags}/{parameter.secondary_opts[0]}"
    if getattr(parameter, "is_flag", False):
        return flags
    return f"{flags} {name or 'VALUE'}"


def _row(flags: str, about: str, column: int) -> list[str]:
    lines = textwrap.wrap(about, _width() - column, break_on_hyphens=False) or [""]
    first = f"  {flags:<{column - 4}}  "
    if len(first) > column:
        return [first.rstrip(), *(" " * column + line for line in lines)]
    return [first + lines[0], *(" " * column + line for line in lines[1:])]


def _clause(text: str, width: int) -> str:
    """The first sentence of a text, shortened at a mark of punctuation or a word to a width."""
    plain = " ".join(text.split())
    sentence = plain.split(". ")[0].removesuffix(".")
    if len(sentence) <= width:
        return sentence
    for mark in (": ", ", ", " ("):
        before = sentence[: width + 1].rpartition(mark)[0]
        if len(before) > width // 3:
            return before
    return textwrap.shorten(sentence, width, placeholder=" ...")


def _default(parameter: Any) -> str:
    shown = parameter.show_default
    if isinstance(shown, str):
        return f" [{shown}]"
    value = getattr(parameter, "default", None)
    plain = isinstance(value, (int, float, str)) and not isinstance(value, bool) and value != ""
    return f" [{value}]" if plain else ""


def _state_defaults(params: list[Any]) -> None:
    """State the value that a parameter has if no option and no file gives it."""
    from snapbeam.model.parameter_file import Config
    from snapbeam.model.parameters import parameters

    table = parameters()
    named = {each: each.name.replace("__", ".") for each in params if each.name and "__" in each.name}
    if not named:
        return
    given = Config().system.parameters
    for parameter, name in named.items():
        if name in table and parameter.metavar != "VALUES":
            value = given.get(name, table[name].default)
            if isinstance(value, (int, float, str)):
                parameter.show_default = f"{value:.6g}" if isinstance(value, float) else str(value)
