"""Fields of parameter dataclasses: each says what it is and its bounds, from which the command line makes an option."""

from __future__ import annotations

from dataclasses import field, fields
from typing import Any

from intaglio.errors import InputError


def option(default: object, help: str, low: float | None = None, high: float | None = None) -> object:
    return field(default=default, metadata={"help": help, "low": low, "high": high})


def check_bounds(parameters: Any, owner: str = "") -> None:
    """InputError for a field outside its bounds."""
    for item in fields(parameters):
        value, low, high = getattr(parameters, item.name), item.metadata.get("low"), item.metadata.get("high")
        if low is not None and not low <= value <= high:
            raise InputError(f"{owner}{item.name} must be between {low:g} and {high:g}, not {value!r}")
