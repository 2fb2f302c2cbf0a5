"""Selection: a tool that cuts a volume open, wherever it is put."""

# T. Kaehler, "Vergleich von Volumenmodellen", 2010: selection volumes with an affine pose, sampled beside the data.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.errors import InputError
from intaglio.volume import Volume

Matrix = NDArray[np.float64]
# kind, offset, nx, ny, nz, sign, two empty; then 3 x 4 to the tool's index, or a plane's four numbers.
HEAD = 20


@dataclass(frozen=True, eq=False)
class Selection:
    """What is inside the tool is removed; or, with keep="inside", what is outside.

    tool            a binary volume (inside where 1), a signed distance volume (inside where negative, mm), or None
                    for a half space: inside where z > 0 of the tool's own frame
    world_from_tool 4x4, moves, turns and scales the tool, RAS+ mm
    A distance volume gives smooth cuts where a binary one of the same size gives steps.
    """

    tool: Volume | None
    world_from_tool: Matrix
    keep: Literal["outside", "inside"] = "outside"

    def __post_init__(self) -> None:
        pose = np.asarray(self.world_from_tool, dtype=np.float64)
        if (
            pose.shape != (4, 4)
            or not np.isfinite(pose).all()
            or abs(np.linalg.det(pose)) < 1e-12
            or (pose[3] != (0, 0, 0, 1)).any()
        ):
            raise InputError(f"pose of a selection must be an invertible affine 4x4 matrix, not {pose.tolist()}")
        if self.keep not in ("outside", "inside"):
            raise InputError(f"keep must be outside or inside, not {self.keep!r}")
        object.__setattr__(self, "world_from_tool", pose)

    @classmethod
    def plane(cls, point: ArrayLike, normal: ArrayLike) -> Selection:
        """Remove the side of a plane that its normal points to; world, mm."""
        n = np.asarray(normal, dtype=np.float64)
        p = np.asarray(point, dtype=np.float64)
        if n.shape != (3,) or p.shape != (3,) or not np.isfinite([*n, *p]).all() or not np.linalg.norm(n) > 1e-12:
            raise InputError(f"plane needs a point and a normal of three numbers, not {p.tolist()}, {n.tolist()}")
        n = n / np.linalg.norm(n)
        side = np.eye(3)[int(np.abs(n).argmin())]
        u = np.cross(n, side)
        u /= np.linalg.norm(u)
        pose = np.eye(4)
        pose[:3, :3] = np.stack([u, np.cross(n, u), n], axis=1)
        pose[:3, 3] = p
        return cls(None, pose)

    @classmethod
    def of(
        cls, tool: Volume, world_from_tool: ArrayLike | None = None, keep: Literal["outside", "inside"] = "outside"
    ) -> Selection:
        """A tool from a binary or a distance volume, where it stands or moved by a pose."""
        low, high = tool.range
        if not (np.isfinite(low) and np.isfinite(high)) or low == high:
            raise InputError(f"{tool.name}: a tool must have an inside and an outside, not values {low:g} to {high:g}")
        if tool.array.dtype.kind == "f" and low >= 0:
            raise InputError(f"{tool.name}: a tool of floats must be a signed distance, negative inside, not {low:g} to {high:g}")
        return cls(tool, np.eye(4) if world_from_tool is None else np.asarray(world_from_tool, dtype=np.float64), keep)

    @property
    def binary(self) -> bool:
        """Whether the tool says only what is inside; otherwise it knows distances."""
        return self.tool is not None and self.tool.array.dtype.kind in "biu" and self.tool.range[0] >= 0

    def moved(self, world_from_world: ArrayLike) -> Selection:
        """The same tool, moved, turned or scaled by a 4x4 matrix."""
        return replace(self, world_from_tool=np.asarray(world_from_world, dtype=np.float64) @ self.world_from_tool)


def packed_selections(selections: Sequence[Selection], volume: Volume) -> tuple[Matrix, NDArray[np.float32]]:
    """(n, 20) heads and the tools' samples end to end, for kernels that ask at indices of `volume`."""
    heads = np.zeros((len(selections), HEAD))
    data: list[NDArray[np.float32]] = []
    offset = 0
    for head, selection in zip(heads, selections, strict=True):
        head[5] = 1.0 if selection.keep == "outside" else -1.0
        tool_from_index = np.linalg.inv(selection.world_from_tool) @ volume.world_from_index
        if selection.tool is None:
            # The tool's z in mm of the world: positive where kept.
            scale = float(np.linalg.norm(selection.world_from_tool[:3, 2]))
            head[8:12] = -scale * tool_from_index[2]
            continue
        tool = selection.tool
        z, y, x = tool.shape
        spacing = float(tool.spacing.min())
        samples = tool.array.astype(np.float32).ravel()
        # A binary tool becomes a ramp of one voxel, in mm like a distance.
        samples = (0.5 - (samples > 0)) * np.float32(spacing) if selection.binary else samples
        head[0:5] = 1.0, offset, x, y, z
        head[8:20] = (tool.index_from_world @ tool_from_index)[:3].ravel()
        data.append(samples.astype(np.float32))
        offset += samples.size
    return heads, np.concatenate(data) if data else np.zeros(1, dtype=np.float32)
