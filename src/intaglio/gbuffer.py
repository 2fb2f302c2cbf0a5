"""GBuffer: what the ink techniques know of a surface, per pixel of its first hit."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from intaglio.camera import Camera

Buffer = NDArray[np.float32]

# Cosine of the angle from which on two faces of a section meet in a corner.
CORNER = 0.9


@dataclass(frozen=True, eq=False)
class GBuffer:
    """The seam between what makes surfaces and what draws them; every array is (height, width, ...) float32.

    depth           mm along the camera's forward; inf where nothing was hit
    normal          (.., 3) world, unit, outwards; 0 where nothing was hit
    curvature       (.., 2) principal curvatures, k1 >= k2, 1/mm, positive where convex
    direction       (.., 3) world, unit: direction of k1 (that of k2 is normal x direction)
    view_curvature  normal curvature along the projected view direction, 1/mm
    light           (.., 3) ambient, diffuse and specular
    edge            (.., 2) where depth jumps between this pixel's centre and the next one's, to the right
                    [0] and below [1]: the part of the way, 0..1, at which it does; NaN where it does not
    section         where a tool or the end of the scan cuts through the body: how dense what is cut is among all of
                    the body, 0..1; NaN on its surface and outside
    """

    camera: Camera
    depth: Buffer
    normal: Buffer
    curvature: Buffer
    direction: Buffer
    view_curvature: Buffer
    light: Buffer
    edge: Buffer
    section: Buffer

    @classmethod
    def empty(cls, camera: Camera) -> GBuffer:
        """Nothing hit anywhere: what a source starts from."""
        w, h = camera.size

        def zeros(*n: int) -> Buffer:
            return np.zeros((h, w, *n), dtype=np.float32)

        return cls(
            camera=camera,
            depth=np.full((h, w), np.inf, dtype=np.float32),
            normal=zeros(3),
            curvature=zeros(2),
            direction=zeros(3),
            view_curvature=zeros(),
            light=zeros(3),
            edge=np.full((h, w, 2), np.nan, dtype=np.float32),
            section=np.full((h, w), np.nan, dtype=np.float32),
        )

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """Where the surface is."""
        return np.isfinite(self.depth)

    @cached_property
    def cut(self) -> NDArray[np.bool_]:
        """Where a section is seen."""
        return self.section >= 0.0

    @cached_property
    def border(self) -> Buffer:
        """`edge`, and half-way between two pixels the rims of sections: where they meet the surface, and one another."""
        if not self.cut.any():
            return self.edge
        out = self.edge.copy()
        for side, here, there in ((0, np.s_[:, :-1], np.s_[:, 1:]), (1, np.s_[:-1, :], np.s_[1:, :])):
            turned = np.einsum("yxc,yxc->yx", self.normal[here], self.normal[there]) < CORNER
            rim = (self.cut[here] != self.cut[there]) | (self.cut[here] & turned)
            out[*here, side][rim & self.mask[here] & self.mask[there] & np.isnan(out[*here, side])] = 0.5
        return out

    @cached_property
    def brightness(self) -> Buffer:
        """Sum of the light's parts, at most 1; 1 where there is only paper."""
        return np.where(self.mask, np.minimum(self.light.sum(axis=2), 1.0), 1.0).astype(np.float32)

    @cached_property
    def pixel_mm(self) -> Buffer:
        """Side of the square that a pixel covers on a plane facing the camera at its depth, in mm; 0 outside."""
        scale = self.depth if self.camera.projection == "perspective" else np.ones_like(self.depth)
        return np.where(self.mask, scale * self.camera.pixel, 0.0).astype(np.float32)

    @cached_property
    def facing(self) -> Buffer:
        """Cosine of the angle between normal and the direction to the viewer; 1 face on, 0 at a contour and outside."""
        if self.camera.projection == "orthographic":
            return (self.normal @ -self.camera.forward).astype(np.float32)
        w, h = self.camera.size
        ray = self.camera.rays()[3:]
        x, y = np.arange(w)[None, :, None] + 0.5, np.arange(h)[:, None, None] + 0.5
        view = ray[0] + x * ray[1] + y * ray[2]
        view /= np.linalg.norm(view, axis=2, keepdims=True)
        return -np.einsum("yxc,yxc->yx", self.normal, view).astype(np.float32)
