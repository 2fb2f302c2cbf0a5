"""`--tf`: a transfer function, by its name or from a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from typer import BadParameter, Option

from intaglio.transfer_function import TransferFunction
from intaglio.volume import Volume


def transfer_function(help: str, **options: Any) -> Any:
    """The option; --preset is another name for it."""
    known = f"{', '.join(TransferFunction.presets())}; ct-... are for Hounsfield units, mr-... follow the scan's range"
    text = f"{help}: a file of 3D Slicer or ParaView, or one of {known}."
    return Option("--tf", "--preset", metavar="NAME|FILE", help=text, **options)


def function_of(text: str | None) -> Callable[[Volume], TransferFunction] | None:
    """What makes the transfer function for a scan, whose range MR presets need; files are read at once."""
    if text is None:
        return None
    if text in TransferFunction.presets():
        return lambda volume: TransferFunction.preset(text, volume.range)
    if not Path(text).exists() and not Path(text).suffix:
        known = ", ".join(TransferFunction.presets())
        raise BadParameter(f"must be one of {known}, or a file, not {text!r}", param_hint="'--tf'")
    function = TransferFunction.read(text)
    return lambda volume: function
