"""Light and Material: Blinn-Phong."""

# J. F. Blinn, "Models of light reflection for computer synthesized pictures", 1977.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from intaglio.camera import Camera
from intaglio.errors import InputError

Kind = Literal["directional", "point", "spot"]
KINDS: tuple[Kind, ...] = ("directional", "point", "spot")


@dataclass(frozen=True, kw_only=True)
class Light:
    """A white light.

    direction  towards the light; for a spot, the axis against which it shines
    position   mm, for point and spot
    frame      "camera": x right, y up, z to the viewer, so the light stays when the view turns,
               positions counted from the eye; "world": RAS+
    cone       spot: half opening angle in degrees, with a soft edge over its last fifth
    """

    kind: Kind = "directional"
    direction: tuple[float, float, float] = (-0.5, 0.65, 0.6)
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frame: Literal["camera", "world"] = "camera"
    intensity: float = 1.0
    cone: float = 30.0

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise InputError(f"light kind must be one of {', '.join(KINDS)}, not {self.kind!r}")
        if self.frame not in ("camera", "world"):
            raise InputError(f"light frame must be camera or world, not {self.frame!r}")
        if len(self.direction) != 3 or not 0 < math.hypot(*self.direction) < math.inf:
            raise InputError(f"light direction must be three numbers that are not all zero, not {self.direction!r}")
        if len(self.position) != 3 or not math.isfinite(math.hypot(*self.position)):
            raise InputError(f"light position must be three numbers in mm, not {self.position!r}")
        if not (math.isfinite(self.intensity) and self.intensity >= 0):
            raise InputError(f"light intensity must not be negative, not {self.intensity!r}")
        if not 0 < self.cone <= 90:
            raise InputError(f"light cone must be between 0 and 90 degrees, not {self.cone!r}")


@dataclass(frozen=True, kw_only=True)
class Material:
    """How a surface answers light: I = ambient + sum of diffuse (n.l) + specular (n.h)^shininess."""

    ambient: float = 0.15
    diffuse: float = 0.85
    specular: float = 0.25
    shininess: float = 24.0
    two_sided: bool = False

    def __post_init__(self) -> None:
        for name in ("ambient", "diffuse", "specular", "shininess"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise InputError(f"material {name} must not be negative, not {value!r}")


DEFAULT_LIGHTS: tuple[Light, ...] = (Light(),)


def packed_lights(lights: Sequence[Light], camera: Camera) -> NDArray[np.float32]:
    """(n, 10) float32 rows for kernels, in world space: kind, direction, position, intensity, cos(cone), cos(inner cone)."""
    world_from_view = camera.view_from_world.T
    rows = np.zeros((len(lights), 10), dtype=np.float32)
    for row, light in zip(rows, lights, strict=True):
        direction = np.asarray(light.direction, dtype=np.float64)
        direction = direction / np.linalg.norm(direction)
        position = np.asarray(light.position, dtype=np.float64)
        if light.frame == "camera":
            direction = world_from_view @ direction
            position = camera.eye + world_from_view @ position
        row[0] = KINDS.index(light.kind)
        row[1:4], row[4:7] = direction, position
        row[7] = light.intensity
        row[8], row[9] = math.cos(math.radians(light.cone)), math.cos(math.radians(0.8 * light.cone))
    return rows
