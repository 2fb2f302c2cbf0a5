"""Camera: where the picture is taken from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.errors import InputError

Vector = NDArray[np.float64]
Projection = Literal["orthographic", "perspective"]

# From the subject towards the viewer, RAS+.
VIEWS: dict[str, tuple[float, float, float]] = {
    "anterior": (0, 1, 0),
    "posterior": (0, -1, 0),
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "superior": (0, 0, 1),
    "inferior": (0, 0, -1),
}


class Subject(Protocol):
    """Anything with corners: a Volume, a TriangleMesh."""

    @property
    def corners(self) -> Vector: ...


@dataclass(frozen=True, eq=False)
class Camera:
    """A view of the world, orthographic or perspective.

    eye, forward, up   world, mm; forward and up are made unit and perpendicular
    size               (width, height) of the image in pixels
    pixel              side of a pixel: in mm (orthographic), in mm at 1 mm distance (perspective)

    Image coordinates run right and down, pixel centres at +0.5; depth is the distance in mm from
    the eye's plane, measured along forward, for both projections.
    """

    eye: Vector
    forward: Vector
    up: Vector
    size: tuple[int, int]
    pixel: float
    projection: Projection = "orthographic"

    def __post_init__(self) -> None:
        width, height = (_checked_side(side) for side in self.size)
        if not (math.isfinite(self.pixel) and self.pixel > 0):
            raise InputError(f"pixel size must be positive, not {self.pixel!r}")
        if self.projection not in ("orthographic", "perspective"):
            raise InputError(f"projection must be orthographic or perspective, not {self.projection!r}")
        eye = np.asarray(self.eye, dtype=np.float64)
        if eye.shape != (3,) or not np.isfinite(eye).all():
            raise InputError(f"eye must be three numbers in mm, not {eye.tolist()}")
        forward, up = _unit(self.forward, "forward"), _unit(self.up, "up")
        up = up - forward * (up @ forward)
        if np.linalg.norm(up) < 1e-9:
            raise InputError(f"up must not be parallel to forward, not {np.asarray(self.up).tolist()}")
        object.__setattr__(self, "eye", eye)
        object.__setattr__(self, "forward", forward)
        object.__setattr__(self, "up", _unit(up, "up"))
        object.__setattr__(self, "size", (width, height))

    @classmethod
    def looking(
        cls,
        view: str | ArrayLike,
        at: Subject | ArrayLike,
        size: int | tuple[int, int] = 1024,
        *,
        projection: Projection = "orthographic",
        fov: float = 25.0,
        distance: float | None = None,
        margin: float = 0.04,
        zoom: float = 1.0,
        roll: float = 0.0,
    ) -> Camera:
        """A camera that sees the whole subject.

        view      anterior, posterior, left, right, superior, inferior; several joined by "-"
                  ("anterior-left"); or a vector from the subject towards the viewer, as numbers or "x,y,z"
        at        a volume, a mesh, or (n, 3) world points that must be in the picture
        size      (width, height) in pixels; a single number is the longer side, the other follows the subject
        fov       perspective only: degrees that the front of the subject's box takes up, which sets the distance
        distance  perspective only: from the subject's centre to the eye in mm, instead of fov
        margin    empty border, as a part of the image's shorter side
        roll      degrees, turns the picture clockwise
        """
        if not 0 <= margin < 0.5:
            raise InputError(f"margin must be between 0 and 0.5, not {margin!r}")
        if not 0 < zoom < math.inf:
            raise InputError(f"zoom must be positive, not {zoom!r}")
        if not math.isfinite(roll):
            raise InputError(f"roll must be a number of degrees, not {roll!r}")
        towards = view_direction(view)
        forward = -towards
        up = np.array([0.0, 1.0, 0.0] if abs(towards[2]) > 0.99 else [0.0, 0.0, 1.0])
        up = _unit(up - forward * (up @ forward), "up")
        angle = math.radians(roll)
        up = up * math.cos(angle) - np.cross(forward, up) * math.sin(angle)
        right = np.cross(forward, up)

        points = np.asarray(at if isinstance(at, np.ndarray | list | tuple) else at.corners, dtype=np.float64)  # type: ignore[union-attr]
        if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0 or not np.isfinite(points).all():
            raise InputError(f"at must be a volume, a mesh or (n, 3) points, not an array of shape {points.shape}")
        frame = np.stack([right, up, forward], axis=1)
        local = points @ frame
        low, high = local.min(axis=0), local.max(axis=0)
        centre = (low + high) / 2
        half = (high - low) / 2
        half = np.maximum(half, max(1e-3 * half.max(), 1e-6))  # a plane, line or point has a picture too
        radius = float(np.linalg.norm(half))

        if projection == "perspective":
            if distance is None:
                if not 1 <= fov <= 120:
                    raise InputError(f"fov must be between 1 and 120 degrees, not {fov!r}")
                distance = half[2] + max(half[0], half[1]) / math.tan(math.radians(fov) / 2)
            if not distance < math.inf:
                raise InputError(f"distance must be a number of mm, not {distance!r}")
            if not distance > half[2] * (1 + 1e-6):
                raise InputError(
                    f"the camera is inside the subject: distance {distance:g} mm from its centre; use more than {half[2]:.4g} mm"
                )
            # What each point spans at 1 mm distance decides, not the box around all of them.
            scale = 1.0 / (local[:, 2] - centre[2] + distance)
            extent = np.abs((local[:, :2] - centre[:2]) * scale[:, None]).max(axis=0)
            extent = np.maximum(extent, half[:2] / (distance + half[2]))
            eye = frame @ np.array([centre[0], centre[1], centre[2] - distance])
        else:
            extent = half[:2]
            eye = frame @ np.array([centre[0], centre[1], centre[2] - 2 * radius])

        width, height = _fitted_size(size, extent, margin)
        free = 1.0 - 2.0 * margin * min(width, height) / np.array([width, height])
        pixel = float(np.max(2 * extent / (free * (width, height)))) / zoom
        return cls(eye, forward, up, (width, height), pixel, projection)

    @property
    def right(self) -> Vector:
        return np.cross(self.forward, self.up)

    @property
    def view_from_world(self) -> Vector:
        """3x3 rotation; rows are right, up and towards the viewer."""
        return np.stack([self.right, self.up, -self.forward])

    def rays(self) -> Vector:
        """(6, 3): origin and direction of the ray at image position (x, y), each as constant + x * second + y * third.

        origin = r[0] + x r[1] + y r[2], direction = r[3] + x r[4] + y r[5]; position = origin + depth * direction.
        """
        w, h = self.size
        corner = -self.pixel * (w / 2) * self.right + self.pixel * (h / 2) * self.up
        dx, dy = self.pixel * self.right, -self.pixel * self.up
        zero = np.zeros(3)
        if self.projection == "orthographic":
            return np.stack([self.eye + corner, dx, dy, self.forward, zero, zero])
        return np.stack([self.eye, zero, zero, self.forward + corner, dx, dy])

    def project(self, points: ArrayLike) -> Vector:
        """(n, 3) world positions to (n, 3) image x, image y in pixels, and depth in mm.

        In perspective, positions of no or negative depth have no place in the image.
        """
        local = (np.asarray(points, dtype=np.float64) - self.eye) @ np.stack([self.right, self.up, self.forward], axis=1)
        depth = local[:, 2]
        scale = self.pixel * (depth if self.projection == "perspective" else np.ones_like(depth))
        w, h = self.size
        return np.stack([w / 2 + local[:, 0] / scale, h / 2 - local[:, 1] / scale, depth], axis=1)


def view_direction(view: str | ArrayLike) -> Vector:
    """Unit vector from the subject towards the viewer, for a view's name or any vector (world, RAS+)."""
    if not isinstance(view, str):
        return _unit(np.asarray(view, dtype=np.float64), "view")
    if "," in view:
        try:
            return _unit([float(number) for number in view.split(",")], "view")
        except ValueError:
            raise InputError(f"view must be three numbers that are not all zero, not {view!r}") from None
    parts = view.strip().lower().split("-")
    unknown = [p for p in parts if p not in VIEWS]
    if unknown:
        raise InputError(f"view must be one of {', '.join(VIEWS)}, several joined by '-', or x,y,z; not {view!r}")
    if len({tuple(map(abs, VIEWS[p])) for p in parts}) < len(parts):
        raise InputError(f"view must not name a side twice or opposite sides, not {view!r}")
    towards = np.sum([VIEWS[p] for p in parts], axis=0, dtype=np.float64)
    return _unit(towards, "view")


def _unit(vector: ArrayLike, name: str) -> Vector:
    v = np.asarray(vector, dtype=np.float64)
    length = float(np.linalg.norm(v)) if v.shape == (3,) else 0.0
    if not (math.isfinite(length) and length > 1e-12):
        raise InputError(f"{name} must be three numbers that are not all zero, not {np.asarray(vector).tolist()}")
    return v / length


def _checked_side(side: float) -> int:
    if not (1 <= side <= 32768 and int(side) == side):
        raise InputError(f"image size must be whole numbers between 1 and 32768 pixels, not {side!r}")
    return int(side)


def _fitted_size(size: int | tuple[int, int], extent: Vector, margin: float) -> tuple[int, int]:
    """A single number is the longer side; the shorter one leaves the same border in pixels."""
    if isinstance(size, tuple):
        width, height = size
        return _checked_side(width), _checked_side(height)
    size = _checked_side(size)
    ratio = float(extent.min() / extent.max())
    # The border is a part b = margin * shorter of the image: shorter - 2b = ratio * (longer - 2b).
    shorter = max(1, round(size * ratio / (1 - 2 * margin + 2 * margin * ratio)), round(size * 0.2))
    return (size, shorter) if extent[0] >= extent[1] else (shorter, size)
