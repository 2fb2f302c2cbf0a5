"""Options that come from the fields of a dataclass, each declared once."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Container
from dataclasses import MISSING, fields, is_dataclass, replace
from functools import wraps
from typing import Annotated, Any, get_type_hints

from typer import BadParameter, Option

from intaglio.cli.options import number
from intaglio.ink.hand import Hand
from intaglio.ink.styles import Hatching, style


def _options_of(parameters: type, prefix: str = "", panel: str = "Style, parameter by parameter") -> list[inspect.Parameter]:
    """One command-line option for each field of a parameter dataclass; None means the style's own value."""
    out = []
    for item in fields(parameters):
        assert item.default is not MISSING
        name, kind = f"--{prefix}{item.name}".replace("_", "-"), type(item.default)
        low, high, text = item.metadata["low"], item.metadata["high"], item.metadata["help"]
        text = text[0].upper() + text[1:]
        look: Any = {"rich_help_panel": panel}
        if item.default is None:
            kind, option = bool, Option(f"{name}/--no-{name[2:]}", help=f"{text}.", show_default=False, **look)
        elif low is None:
            option = Option(name, metavar="#RRGGBB" if "#rrggbb" in text else "NAME|FILE", help=f"{text}.", **look)
        else:
            option = number(name, text, low, high, kind=kind, **look)
        annotation: Any = Annotated[kind | None, option]
        out.append(inspect.Parameter(prefix + item.name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation))
    return out


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Replace a command's parameters that are groups of options, such as Reading, by the options."""
    signature = inspect.signature(command, eval_str=True)
    groups: dict[str, Any] = {p.name: p.annotation for p in signature.parameters.values() if is_dataclass(p.annotation)}
    flat = []
    for parameter in signature.parameters.values():
        if parameter.name not in groups:
            flat.append(parameter)
            continue
        group = groups[parameter.name]
        hints = get_type_hints(group, include_extras=True)
        flat += [parameter.replace(name=f.name, default=f.default, annotation=hints[f.name]) for f in fields(group)]

    @wraps(command)
    def run(**given: Any) -> None:
        for name, group in groups.items():
            given[name] = group(**{f.name: given.pop(f.name) for f in fields(group)})
        command(**given)

    run.__signature__ = signature.replace(parameters=flat)  # type: ignore[attr-defined]
    run.__annotations__ = {p.name: p.annotation for p in flat} | {"return": None}
    return run


def with_options(parameters: type, *, only: Container[str] | None = None, **parts: type) -> Callable[..., Callable[..., None]]:
    """Replace a command's **parameters by the options of a dataclass, so that each is declared once.

    only   names of the fields that matter to the command
    parts  dataclasses that fields hold; their options are --FIELD-NAME
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        signature = inspect.signature(command, eval_str=True)
        own = [p for p in signature.parameters.values() if p.kind is not inspect.Parameter.VAR_KEYWORD]
        derived = [p for p in _options_of(parameters) if only is None or p.name in only]
        helps = {item.name: item.metadata["help"] for item in fields(parameters)}
        for name, part in parts.items():
            derived += _options_of(part, f"{name}_", helps[name].capitalize())
        keyword = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in own] + derived
        command.__signature__ = signature.replace(parameters=keyword)  # type: ignore[attr-defined]
        command.__annotations__ = {p.name: p.annotation for p in keyword} | {"return": None}
        return command

    return decorate


def styled(name: str, parameters: dict[str, Any]) -> Hatching:
    """A style with what was given on the command line; any option of a hand's asks for contours by hand."""
    changes = {key: value for key, value in parameters.items() if value is not None}
    moves = {key: changes.pop(key) for key in list(changes) if key.startswith("hand_")}
    by_hand = changes.pop("hand", None)
    if by_hand is False and moves:
        option = next(iter(moves)).replace("_", "-")
        raise BadParameter("cannot be given together with --no-hand", param_hint=f"'--{option}'")
    own = style(name).hand
    if by_hand is not None or moves:
        hand = replace(own or Hand(), **{key.removeprefix("hand_"): value for key, value in moves.items()})
        changes["hand"] = None if by_hand is False else hand
    return style(name, **changes)
