"""Options that several commands have, and groups that a command takes as one argument."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import Field, dataclass, field, fields
from functools import wraps
from pathlib import Path
from typing import Any

import click

from benchmarks.cli.errors import BadInput


@dataclass(frozen=True)
class OptionGroup:
    """Options of a command, a field each; a subclass makes its fields with :func:`option`."""

    @property
    def given(self) -> list[str]:
        """The options that the command line gives, as they are written there."""
        return [
            _added(each)[0]
            for each in fields(self)
            if each.metadata and _is_given(getattr(self, each.name))
        ]


def _is_given(value: object) -> bool:
    return value is not None and value is not False and value != ()


def option(flag: str = "", **settings: Any) -> Any:
    """A field of a group that an option fills.

    Args:
        flag: the option, where that is not the field's name: ``--max-usd`` for ``max_usd``.
        settings: those of :func:`click.option`.
    """
    empty: Any = () if settings.get("multiple") else False if settings.get("is_flag") else None
    return field(default=empty, metadata={"flag": flag, "settings": settings})


def shared_option(add: Any) -> Any:
    """A field of a group that an option fills which other commands have, too."""
    (made,) = add(lambda: None).__click_params__
    return field(default=() if made.multiple else None, metadata={"add": add, "flag": made.opts[0]})


def _added(each: Field[Any]) -> tuple[str, Any]:
    """A field's option as it is written, and what adds it to a command."""
    flag = each.metadata.get("flag") or f"--{each.name.replace('_', '-')}"
    if "settings" in each.metadata:
        return flag, click.option(flag, each.name, **each.metadata["settings"])
    return flag, each.metadata.get("add", lambda command: command)


def with_options(**groups: type[OptionGroup]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Add the options of groups to a command, which gets each group as an argument of its name."""

    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(command)
        def with_groups(**given: Any) -> Any:
            for name, group in groups.items():
                values = {each.name: given.pop(each.name, each.default) for each in fields(group)}
                given[name] = group(**values)
            return command(**given)

        for group in reversed(groups.values()):
            for each in reversed(fields(group)):
                _added(each)[1](with_groups)
        return with_groups

    return add


LANGUAGES = ("en", "zh")
"""As in ``er_gym.data.trajectory``, which is too slow to import for ``--help``; a test compares."""

SCORER_CHOICES = ("both", "paper", "corrected")
"""As in ``benchmarks.scoring.report``, for the same reason."""

scorer_option = click.option(
    "--scorer",
    type=click.Choice(SCORER_CHOICES),
    default="both",
    show_default=True,
    help="The table's scorer; both shows each where they differ.",
)

PROTOCOL_CHOICES = ("default", "paper")
"""As in ``er_gym.envs.protocol``, for the same reason."""

protocol_option = click.option(
    "--protocol",
    type=click.Choice(PROTOCOL_CHOICES),
    default=PROTOCOL_CHOICES[0],
    show_default=True,
    help="The rules of an episode; paper uses those of the paper's evaluation program, to compare "
    "results with its table.",
)


class FaultsType(click.ParamType):
    """Rates of faults: ``0.1``, or ``navigate=0.2,open=0.1``."""

    name = "RATES"

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        from er_gym.envs.faults import parse_faults

        if not isinstance(value, str):
            return value
        try:
            return parse_faults(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


faults_option = click.option(
    "--faults",
    type=FaultsType(),
    metavar="RATE | KIND=RATE,…",
    help="Let actions go wrong at this rate, such as 0.1 or navigate=0.2,open=0.1.  [default: 0]",
)

_MOST_WORKERS = 256
"""Each worker takes 100 MB or more."""
MOST_SAMPLES = 10_000
"""More samples of a task than anybody plays; a larger number is a slip of the fingers."""
MOST_SEED = 2**32 - 1
"""The largest seed that NumPy's and PyTorch's generators accept."""

seed_option = click.option(
    "--seed",
    type=click.IntRange(0, MOST_SEED),
    default=0,
    show_default=True,
    help="The seed of all random choices.",
)

workers_type = click.IntRange(1, _MOST_WORKERS)

workers_option = click.option(
    "--workers",
    type=workers_type,
    default=os.cpu_count() or 1,
    help="The number of processes.  [default: one for each processor]",
)


def size_option(name: str) -> Any:
    """``--width`` or ``--height``, of pictures; None for the suite's own."""
    return click.option(
        name, type=click.IntRange(16, 4096), help="Picture size in pixels.  [default: the suite's]"
    )


def given_size(width: int | None, height: int | None) -> dict[str, int]:
    """The environment's arguments that these options give."""
    size = {"width": width, "height": height}
    return {name: pixels for name, pixels in size.items() if pixels is not None}


def port_option(default: int) -> Any:
    """``--port``, of a server."""
    return click.option(
        "--port",
        type=click.IntRange(0, 65535),
        default=default,
        show_default=True,
        help="The port; 0 for a free one.",
    )


force_option = click.option(
    "--force", is_flag=True, help="Also replace files that er-gym did not write."
)

agent_config_option = click.option(
    "--agent-config",
    metavar="FILE",
    help="The agent's settings: a YAML file, or the name of one that comes with er-gym.",
)


def overrides_option(example: str) -> Any:
    """``--set NAME=VALUE``, which overrides settings of a file."""
    return click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="NAME=VALUE",
        help=f"Override a setting, such as {example}; may be repeated.",
    )


def split(*lists: str | None) -> list[str]:
    """The words of comma-separated lists."""
    return [word.strip() for text in lists for word in (text or "").split(",") if word.strip()]


def named(option: str, text: str | None) -> list[str]:
    """The words of an option's comma-separated list; empty only if the option was not given."""
    if text is not None and not split(text):
        raise BadInput(f"{option} {text!r} names nothing; name one, or leave it out")
    return split(text)


class NonEmptyPath(click.Path):
    """A path; an empty one, which click takes for the working directory, is refused."""

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        if not os.fspath(value):
            self.fail("an empty name; give a path, '.' for the working directory", param, ctx)
        return super().convert(value, param, ctx)


class Words(click.ParamType):
    """A text that UTF-8 can hold, as a record must; paths may be any bytes."""

    name = "text"

    def convert(self, value: Any, param: Any, ctx: Any) -> str:
        try:
            str(value).encode()
        except UnicodeEncodeError:
            self.fail(f"{value!a:.80} is not UTF-8 text; spell it in UTF-8", param, ctx)
        return str(value)


PATH = NonEmptyPath(path_type=Path)
FILE = NonEmptyPath(dir_okay=False, path_type=Path)
FOLDER = NonEmptyPath(file_okay=False, path_type=Path)
EXISTING_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
EXISTING_FOLDER = NonEmptyPath(exists=True, file_okay=False, path_type=Path)


class Finite(click.FloatRange):
    """A finite number, optionally in a range."""

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number", param, ctx)
        return float(number)


class Span(click.ParamType):
    """``3``, ``2-5`` or ``4-``: from and to, both included."""

    name = "A-B"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[float, float | None]:
        low, dash, high = str(value).partition("-")
        try:
            start = float(low)
            return start, (float(high) if high else None) if dash else start
        except ValueError:
            self.fail(f"{value!r} is not a range; give a number, A-B, or A- for no end", param, ctx)
