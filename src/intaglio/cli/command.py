"""What all commands have in common as commands: every option once, and exit codes."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from typer import BadParameter
from typer.core import TyperCommand

from intaglio.errors import InputError

# What typer raises for wrong usage; of that family it names only BadParameter.
UsageError: Any = BadParameter.__mro__[1]


class Command(TyperCommand):
    """A command that refuses an option given twice, of which typer would keep the last."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        _, _, given = self.make_parser(ctx).parse_args(args=list(args))
        for option in given:
            if option.param_type_name == "option" and not option.multiple and given.count(option) > 1:
                names = " and ".join([next(o for o in option.opts if o.startswith("--")), *option.secondary_opts])
                raise UsageError(f"{names} can be given only once", ctx)
        return super().parse_args(ctx, args)

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters; switches do not name the type of a value they do not take."""
        params = super().get_params(ctx)
        for option in params:
            if getattr(option, "is_flag", False):
                option.metavar = ""
        return params


@contextmanager
def as_written() -> Iterator[None]:
    """What is wrong in here is wrong with the command as it was written, unless a file is missing: exit code 2, not 1."""
    try:
        yield
    except InputError as error:
        if isinstance(error.__cause__, OSError):
            raise
        raise UsageError(str(error)) from None
