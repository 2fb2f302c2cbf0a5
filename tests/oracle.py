"""Slow float64 twins of the kernels, and surfaces whose forms are known."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage

from intaglio import Camera, GBuffer, Light, Material, TransferFunction, Volume

Array = NDArray[np.float64]
Field = Callable[[Array], Array]


def trilinear(voxels: ArrayLike, points: ArrayLike) -> Array:
    """Values at (n, 3) indices (x, y, z): the eight neighbours, each weighted by its share; outside, the nearest inside."""
    grid = np.asarray(voxels, dtype=np.float64)
    last = np.array(grid.shape[::-1]) - 1.0
    p = np.clip(np.asarray(points, dtype=np.float64), 0.0, last)
    total = np.zeros(len(p))
    for corner in np.ndindex(2, 2, 2):
        cell = np.minimum(np.floor(p), last - 1) + corner
        weight = np.prod(1.0 - np.abs(p - cell), axis=1)
        x, y, z = cell.astype(int).T
        total += weight * grid[z, y, x]
    return total


def _basis(t: Array) -> tuple[Array, Array, Array]:
    """The cubic B-spline around 0, its first and its second derivative."""
    a = np.abs(t)
    near, far = a < 1.0, a < 2.0
    value = np.where(near, 2 / 3 - a**2 + a**3 / 2, np.where(far, (2 - a) ** 3 / 6, 0.0))
    first = np.where(near, -2 * t + 1.5 * t * a, np.where(far, -np.sign(t) * (2 - a) ** 2 / 2, 0.0))
    second = np.where(near, 3 * a - 2, np.where(far, 2 - a, 0.0))
    return value, first, second


def bspline(voxels: ArrayLike, point: ArrayLike) -> tuple[float, Array, Array]:
    """Value, gradient (3,) and Hessian (3, 3) at one index (x, y, z): the sum over all voxels of voxel times basis."""
    grid = np.asarray(voxels, dtype=np.float64)
    # Two more layers of the border's voxels, which is as far as the basis reaches.
    grid = np.pad(grid, 2, mode="edge")
    x, y, z = (_basis(c - (np.arange(n) - 2.0)) for c, n in zip(np.asarray(point, float), grid.shape[::-1], strict=True))

    def total(i: int, j: int, k: int) -> float:
        return float(np.einsum("zyx,z,y,x->", grid, z[k], y[j], x[i]))

    gradient = np.array([total(1, 0, 0), total(0, 1, 0), total(0, 0, 1)])
    xy, xz, yz = total(1, 1, 0), total(1, 0, 1), total(0, 1, 1)
    hessian = np.array([[total(2, 0, 0), xy, xz], [xy, total(0, 2, 0), yz], [xz, yz, total(0, 0, 2)]])
    return total(0, 0, 0), gradient, hessian


@dataclass(frozen=True)
class Bend:
    """Of a surface at n points: normal (n, 3), curvatures k1 >= k2 (n, 2), direction of k1 (n, 3), shape operator (n, 3, 3)."""

    normal: Array
    curvature: Array
    direction: Array
    operator: Array


def bend(gradient: ArrayLike, hessian: ArrayLike) -> Bend:
    """The body lies where the field is greater. Kindlmann et al. 2003: n = -g / |g|, P = I - n n', G = -P H P / |g|."""
    g, h = np.atleast_2d(np.asarray(gradient, float)), np.asarray(hessian, float).reshape(-1, 3, 3)
    size = np.linalg.norm(g, axis=1)
    normal = -g / size[:, None]
    p = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    operator = -p @ h @ p / size[:, None, None]
    curvature, direction = np.empty((len(g), 2)), np.empty((len(g), 3))
    for i in range(len(g)):
        # The eigenvectors of P are the normal (eigenvalue 0) and a basis of the tangent plane.
        plane = np.linalg.eigh(p[i])[1][:, 1:]
        values, vectors = np.linalg.eigh(plane.T @ operator[i] @ plane)
        curvature[i] = values[::-1]
        direction[i] = plane @ vectors[:, 1]
    return Bend(normal, curvature, direction, operator)


def euler(curvature: ArrayLike, direction: ArrayLike, normal: ArrayLike, view: ArrayLike) -> Array:
    """Normal curvature k1 cos² + k2 sin² in the direction of the view's part in the tangent plane."""
    k, e, n, v = (np.asarray(a, dtype=np.float64) for a in (curvature, direction, normal, view))
    w = v - n * (n * v).sum(axis=-1, keepdims=True)
    cos2 = (w * e).sum(axis=-1) ** 2 / (w * w).sum(axis=-1)
    return np.asarray(k[..., 0] * cos2 + k[..., 1] * (1.0 - cos2))


def march(field: Field, origins: Array, directions: Array, start: float, stop: float, step: float) -> Array:
    """(n,) least t at which field(origin + t direction) reaches 0 from below, found in small steps, then halved; inf for none."""
    low, high = np.full(len(origins), start), np.full(len(origins), np.inf)
    still = np.flatnonzero(field(origins + start * directions) < 0.0)
    for t in np.arange(start + step, stop + step, step):
        reached = field(origins[still] + t * directions[still]) >= 0.0
        high[still[reached]] = t
        still = still[~reached]
        low[still] = t
    found = np.isfinite(high)
    o, d, a, b = origins[found], directions[found], low[found], high[found]
    for _ in range(50):
        m = 0.5 * (a + b)
        reached = field(o + m[:, None] * d) >= 0.0
        a, b = np.where(reached, a, m), np.where(reached, m, b)
    high[found] = b
    return high


def rays(camera: Camera, x: ArrayLike, y: ArrayLike) -> tuple[Array, Array]:
    """Origins and directions (n, 3), by depth, of the rays through image positions."""
    x, y = np.asarray(x, dtype=np.float64)[:, None], np.asarray(y, dtype=np.float64)[:, None]
    r = camera.rays()
    return r[0] + x * r[1] + y * r[2], r[3] + x * r[4] + y * r[5]


def blinn_phong(
    position: Array, normal: Array, camera: Camera, lights: Sequence[Light], material: Material
) -> tuple[float, float, float]:
    """Ambient, diffuse and specular light of one point."""
    view = _unit(camera.eye - position) if camera.projection == "perspective" else -camera.forward
    diffuse = specular = 0.0
    for light in lights:
        towards, place = _unit(np.asarray(light.direction, float)), np.asarray(light.position, float)
        if light.frame == "camera":
            axes = np.stack([camera.right, camera.up, -camera.forward], axis=1)
            towards, place = axes @ towards, camera.eye + axes @ place
        power, axis = light.intensity, towards
        if light.kind != "directional":
            towards = _unit(place - position)
        if light.kind == "spot":
            off_axis = math.degrees(math.acos(min(1.0, max(-1.0, float(towards @ axis)))))
            outer, inner = math.cos(math.radians(light.cone)), math.cos(math.radians(0.8 * light.cone))
            s = min(1.0, max(0.0, (math.cos(math.radians(off_axis)) - outer) / (inner - outer)))
            power *= s * s * (3 - 2 * s)
        lit, shine = float(normal @ towards), float(normal @ _unit(towards + view))
        if material.two_sided:
            lit, shine = abs(lit), abs(shine)
        if lit > 0:
            diffuse += power * lit
            specular += power * max(shine, 0.0) ** material.shininess
    return material.ambient, material.diffuse * diffuse, material.specular * specular


def gap(a: ArrayLike, b: ArrayLike) -> float:
    """Least distance of a point of a (n, 2) from a point of b (m, 2)."""
    difference = np.asarray(a, float)[:, None] - np.asarray(b, float)[None]
    return float(np.sqrt((difference**2).sum(axis=2).min(initial=np.inf)))


def _unit(v: Array) -> Array:
    return v / np.linalg.norm(v)


@dataclass(frozen=True)
class Sphere:
    """Every surface here is where its field, in mm and positive inside, is 0; bend tells normal and curvature there."""

    radius: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def field(self, p: Array) -> Array:
        return np.asarray(self.radius - np.linalg.norm(p - self.centre, axis=-1))

    def bend(self, p: Array) -> Bend:
        q = p - np.asarray(self.centre)
        size = np.linalg.norm(q, axis=1)[:, None, None]
        return bend(-q / size[:, 0], -(np.eye(3) - q[:, :, None] * q[:, None] / size**2) / size)


@dataclass(frozen=True)
class Cylinder:
    """Without end, through the origin."""

    radius: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def _across(self, p: Array) -> Array:
        a = _unit(np.asarray(self.axis))
        return np.asarray(p - (p @ a)[..., None] * a)

    def field(self, p: Array) -> Array:
        return np.asarray(self.radius - np.linalg.norm(self._across(p), axis=-1))

    def bend(self, p: Array) -> Bend:
        a = _unit(np.asarray(self.axis))
        q = self._across(p)
        size = np.linalg.norm(q, axis=1)[:, None, None]
        across = np.eye(3) - a[:, None] * a
        return bend(-q / size[:, 0], -(across - q[:, :, None] * q[:, None] / size**2) / size)


@dataclass(frozen=True)
class Torus:
    """Around the z axis: its tube of radius `tube` runs round a circle of radius `ring`."""

    ring: float
    tube: float

    def field(self, p: Array) -> Array:
        return np.asarray(self.tube - np.hypot(np.hypot(p[..., 0], p[..., 1]) - self.ring, p[..., 2]))

    def bend(self, p: Array) -> Bend:
        """From the parametrisation: 1 / tube round the tube and cos t / (ring + tube cos t) round the ring."""
        rho = np.hypot(p[:, 0], p[:, 1])
        t = np.arctan2(p[:, 2], rho - self.ring)
        out = np.stack([p[:, 0] / rho, p[:, 1] / rho, np.zeros(len(p))], axis=1)
        up = np.array([0.0, 0.0, 1.0])
        c, s = np.cos(t)[:, None], np.sin(t)[:, None]
        normal, around = c * out + s * up, -s * out + c * up
        along = np.cross(up, out)
        k1, k2 = np.full(len(p), 1 / self.tube), np.cos(t) / (self.ring + self.tube * np.cos(t))
        operator = (
            k1[:, None, None] * around[:, :, None] * around[:, None] + k2[:, None, None] * along[:, :, None] * along[:, None]
        )
        return Bend(normal, np.stack([k1, k2], axis=1), around, operator)


@dataclass(frozen=True)
class Saddle:
    """z = (x² - y²) / (2 scale), the body below it; at the origin k1 = 1 / scale along y and k2 = -1 / scale along x."""

    scale: float

    def field(self, p: Array) -> Array:
        return np.asarray((p[..., 0] ** 2 - p[..., 1] ** 2) / (2 * self.scale) - p[..., 2])

    def bend(self, p: Array) -> Bend:
        gradient = np.stack([p[:, 0] / self.scale, -p[:, 1] / self.scale, np.full(len(p), -1.0)], axis=1)
        return bend(gradient, np.broadcast_to(np.diag([1 / self.scale, -1 / self.scale, 0.0]), (len(p), 3, 3)))


@dataclass(frozen=True)
class Hollow:
    """Solid all around another body."""

    body: Sphere | Cylinder | Torus | Saddle

    def field(self, p: Array) -> Array:
        return -self.body.field(p)

    def bend(self, p: Array) -> Bend:
        b = self.body.bend(p)
        return Bend(-b.normal, -b.curvature[:, ::-1], np.cross(b.normal, b.direction), -b.operator)


def inside_grid(shape: tuple[int, int, int], world_from_index: Array) -> Field:
    """How far, in voxels, a place is inside the outermost voxel centres; negative outside."""
    index_from_world, last = np.linalg.inv(world_from_index), np.array(shape[::-1]) - 1.0

    def field(p: Array) -> Array:
        index = p @ index_from_world[:3, :3].T + index_from_world[:3, 3]
        return np.asarray(np.minimum(index, last - index).min(axis=-1))

    return field


def centred(shape: tuple[int, int, int], axes: ArrayLike | None = None) -> Array:
    """world_from_index of a grid around the origin, whose axes are the columns of a 3x3 matrix."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if axes is None else axes
    matrix[:3, 3] = -matrix[:3, :3] @ (np.array(shape[::-1]) - 1) / 2
    return matrix


def sampled(field: Field, shape: tuple[int, int, int], world_from_index: Array | None = None, dtype: str = "float32") -> Volume:
    """A field in mm at the voxel centres of a grid (z, y, x), around the origin unless the matrix says otherwise.

    Integers hold 10 (uint8) or 100 (int16) steps a millimetre around 128 or 0, as far as the type goes.
    """
    matrix = centred(shape) if world_from_index is None else world_from_index
    z, y, x = np.indices(shape, dtype=np.float64)
    values = field(np.stack([x, y, z], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3])
    if dtype == "uint8":
        values = np.clip(np.round(128 + 10 * values), 0, 255)
    elif dtype == "int16":
        values = np.clip(np.round(100 * values), -32768, 32767)
    return Volume(values.astype(dtype), matrix)


def sheet(size: tuple[int, int], pixel: float = 0.5, depth: float = 100.0, light: ArrayLike = 0.5) -> GBuffer:
    """A flat sheet that fills a picture (height, width) and faces the viewer, who looks at it from anterior."""
    height, width = size
    eye, forward, up = np.zeros(3), np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 1.0])
    gb = GBuffer.empty(Camera(eye, forward, up, (width, height), pixel))
    gb.depth[:] = depth
    gb.normal[:] = -forward
    gb.direction[:] = gb.camera.right
    gb.light[..., 1] = light
    return gb


def mark_edges(gb: GBuffer, label: ArrayLike) -> None:
    """Edges half way between neighbouring pixels of different labels (height, width)."""
    parts = np.asarray(label)
    gb.edge[:, :-1, 0][parts[:, 1:] != parts[:, :-1]] = 0.5
    gb.edge[:-1, :, 1][parts[1:] != parts[:-1]] = 0.5


def path(volume: Volume, camera: Camera, x: float, y: float) -> tuple[Array, Array, float, float, float]:
    """Of one ray: origin and direction in index space, depths where it enters and leaves the voxel centres, mm a depth."""
    origin, direction = (a[0] for a in rays(camera, [x], [y]))
    matrix = np.linalg.inv(volume.world_from_index)
    o, d = matrix[:3, :3] @ origin + matrix[:3, 3], matrix[:3, :3] @ direction
    near, far = 0.0, math.inf
    for c, last in enumerate(np.array(volume.shape[::-1]) - 1.0):
        if d[c] != 0:
            a, b = sorted(((0.0 - o[c]) / d[c], (last - o[c]) / d[c]))
            near, far = max(near, a), min(far, b)
        elif not 0 <= o[c] <= last:
            far = -math.inf
    return o, d, near, far, float(np.linalg.norm(direction))


def emission_absorption(
    volume: Volume, function: TransferFunction, camera: Camera, x: float, y: float, step: float, classify: str = "post"
) -> Array:
    """(4,) premultiplied, unlit, of one ray: samples in the middles of `step` mm each, the last one of what is left.

    "pre" interpolates the voxels' colours, weighted by their opacity in a step.
    """
    origin, direction, near, far, mm = path(volume, camera, x, y)
    length = (far - near) * mm
    if length <= 0:
        return np.zeros(4)
    count = max(math.ceil(length / step - 1e-6), 1)
    part = np.ones(count)
    part[-1] = length / step - (count - 1)
    points = origin + (near + (np.arange(count) + 0.5 * part)[:, None] * step / mm) * direction

    def lookup(values: ArrayLike) -> Array:
        known = np.array([(p.value, *p.colour, p.opacity) for p in function.points])
        rgba = np.stack([np.interp(values, known[:, 0], known[:, c]) for c in range(1, 5)], axis=-1)
        rgba[..., 3] = 1.0 - (1.0 - rgba[..., 3]) ** (step / function.reference_length)
        return np.asarray(rgba)

    if classify == "pre":
        voxels = lookup(volume.samples)
        voxels[..., :3] *= voxels[..., 3:]
        rgba = np.stack([trilinear(voxels[..., c], points) for c in range(4)], axis=1)
        colour, alpha = rgba[:, :3] / np.maximum(rgba[:, 3:], 1e-12), rgba[:, 3]
    else:
        rgba = lookup(trilinear(volume.samples, points))
        colour, alpha = rgba[:, :3], rgba[:, 3]
    alpha = 1.0 - (1.0 - alpha) ** part
    left = np.concatenate([[1.0], np.cumprod(1.0 - alpha)])
    weight = left[:-1] * alpha
    return np.array([*(weight[:, None] * colour).sum(axis=0), 1.0 - left[-1]])


def crossings(volume: Volume, camera: Camera, x: float, y: float, isovalues: Sequence[float]) -> list[tuple[float, int]]:
    """Depths on one ray where the trilinear field crosses isovalues, and which of them, by depth."""
    origin, direction, near, far, _ = path(volume, camera, x, y)
    if not near < far:
        return []

    def field(t: ArrayLike) -> Array:
        return trilinear(volume.samples, origin + np.atleast_1d(t)[:, None] * direction)

    t = np.linspace(near, far, 4001)
    values = field(t)
    found = []
    for n, iso in enumerate(isovalues):
        for i in np.flatnonzero((values[:-1] < iso) != (values[1:] < iso)):
            a, b = t[i], t[i + 1]
            for _ in range(50):
                m = 0.5 * (a + b)
                a, b = (m, b) if (field(m)[0] < iso) == (values[i] < iso) else (a, m)
            found.append((float(b), n))
    return sorted(found)


def distance_to_line(places: ArrayLike, points: ArrayLike) -> Array:
    """(n,) distance of places (n, 2) to the polyline through points (m, 2)."""
    p, line = np.asarray(places, dtype=np.float64), np.asarray(points, dtype=np.float64)
    least = np.full(len(p), np.inf)
    for a, b in pairwise(line):
        along = b - a
        t = np.clip((p - a) @ along / max(along @ along, 1e-300), 0.0, 1.0)
        least = np.minimum(least, np.linalg.norm(p - a - t[:, None] * along, axis=1))
    return least


def shells(radii: Sequence[float], values: Sequence[float], shape: tuple[int, int, int], soft: float = 1.0) -> Volume:
    """Balls around the origin in each other, in mm and voxels of 1 mm: the first value outside, one more within each radius.

    Values pass into one another over about `soft` mm.
    """
    z, y, x = np.indices(shape, dtype=np.float64)
    matrix = centred(shape)
    r = np.linalg.norm(np.stack([x, y, z], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3], axis=-1)
    total = np.full(shape, float(values[0]))
    for radius, before, after in zip(radii, values, values[1:], strict=False):
        total += (after - before) / (1.0 + np.exp(np.clip(4.0 * (r - radius) / soft, -60.0, 60.0)))
    return Volume(total.astype(np.float32), matrix)


def stamped(
    nodes: ArrayLike, count: ArrayLike, offsets: Sequence[int], tip: ArrayLike, sizes: int, size: tuple[int, int]
) -> Array:
    """(h, w) pigment of tips (sizes, side, side) stamped along strokes without jitter or turning, a stamp at a time.

    nodes are x, y, reach, tip width, pigment of a stamp; stamps are where `count` is whole. A tip is seen bilinearly, at
    the smallest of its sizes, each half the one before, that is larger than half of what it is to be.
    """
    nodes, count, tip = np.asarray(nodes, dtype=float), np.asarray(count, dtype=float), np.asarray(tip, dtype=float)
    largest = tip.shape[-1] - 2
    y, x = np.indices(size) + 0.5
    out = np.zeros(size)
    for first, end in pairwise(offsets):
        for k in range(int(np.ceil(count[first])), int(np.floor(count[end - 1])) + 1):
            i = min(max(int(np.searchsorted(count[first:end], k)) - 1 + first, first), end - 2)
            t = (k - count[i]) / (count[i + 1] - count[i])
            cx, cy, _, wide, pigment = nodes[i] + t * (nodes[i + 1] - nodes[i])
            way = nodes[i + 1, :2] - nodes[i, :2]
            c, s = way / np.linalg.norm(way)
            level = next((n for n in range(sizes) if largest >> n <= 2 * wide), sizes - 1)
            n = largest >> level
            u = ((x - cx) * c + (y - cy) * s) / wide * n + (n + 1) / 2
            v = ((y - cy) * c - (x - cx) * s) / wide * n + (n + 1) / 2
            out += pigment * ndimage.map_coordinates(tip[level][: n + 2, : n + 2], [v, u], order=1, mode="constant")
    return out


def signed_distance(mask: NDArray[np.bool_], spacing: ArrayLike) -> Array:
    """Distance (z, y, x) from voxel centres to the nearest box of a voxel on the other side; spacing (x, y, z)."""
    step = np.asarray(spacing, dtype=np.float64)[::-1]
    place = np.argwhere(np.ones(mask.shape, dtype=bool))
    side = mask.ravel()
    out = np.empty(len(place))
    for i, p in enumerate(place):
        gap = (np.maximum(np.abs(place[side != side[i]] - p), 0.5) - 0.5) * step
        out[i] = np.sqrt((gap**2).sum(axis=1).min())
    return np.where(side, -out, out).reshape(mask.shape)


def positions(volume: Volume) -> Array:
    """(z, y, x, 3) world positions of a volume's voxels."""
    k, j, i = np.indices(volume.shape)
    return np.stack([i, j, k], axis=-1) @ volume.world_from_index[:3, :3].T + volume.world_from_index[:3, 3]


def ball(points: Array, centre: ArrayLike, radius: float) -> Array:
    """Signed distance to a ball."""
    return np.linalg.norm(points - np.asarray(centre, dtype=np.float64), axis=-1) - radius


def box(points: Array, centre: ArrayLike, half: ArrayLike) -> Array:
    """Signed distance to a box along the axes, of half its size."""
    q = np.abs(points - np.asarray(centre, dtype=np.float64)) - np.asarray(half, dtype=np.float64)
    return np.linalg.norm(np.maximum(q, 0.0), axis=-1) + np.minimum(q.max(axis=-1), 0.0)


def point_triangle_distance(points: ArrayLike, corners: ArrayLike) -> Array:
    """(n,) distances of points (n, 3) from one triangle (3, 3): the plane where the foot is inside, else the sides."""
    p, (a, b, c) = np.asarray(points, float), np.asarray(corners, float)

    def side(u: Array, v: Array) -> Array:
        d = v - u
        t = np.clip(((p - u) @ d) / max(d @ d, 1e-300), 0.0, 1.0)
        return np.linalg.norm(p - u - t[:, None] * d, axis=1)

    best = np.minimum(np.minimum(side(a, b), side(b, c)), side(c, a))
    normal = np.cross(b - a, c - a)
    if np.linalg.norm(normal) > 0:
        unit = normal / np.linalg.norm(normal)
        over = np.ones(len(p), dtype=bool)
        for u, v in ((a, b), (b, c), (c, a)):
            over &= (p - u) @ np.cross(unit, v - u) >= 0
        best = np.where(over, np.minimum(best, np.abs((p - a) @ unit)), best)
    return best


def mesh_distance(points: ArrayLike, vertices: ArrayLike, triangles: ArrayLike) -> Array:
    """(n,) unsigned distances of points from a mesh: the least over all triangles."""
    corners = np.asarray(vertices, float)[np.asarray(triangles)]
    return np.min([point_triangle_distance(points, tri) for tri in corners], axis=0)


def winding_number(points: ArrayLike, vertices: ArrayLike, triangles: ArrayLike) -> Array:
    """(n,) generalized winding numbers: the solid angles of all triangles, by van Oosterom and Strackee 1983."""
    p = np.asarray(points, float)
    total = np.zeros(len(p))
    for tri in np.asarray(vertices, float)[np.asarray(triangles)]:
        a, b, c = (corner - p for corner in tri)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = np.einsum("ij,ij->i", a, b) * lc + np.einsum("ij,ij->i", b, c) * la + np.einsum("ij,ij->i", c, a) * lb
        total += np.arctan2(volume, la * lb * lc + dots) / (2 * np.pi)
    return total


def may_change_sides(mask: np.ndarray) -> np.ndarray:
    """Voxels of a mask and of what is around that are at the border, touch one of their side that is not, and are not beside
    one of their side that is at the border without touching such a one. The grid goes on as its border is."""
    from scipy import ndimage

    mask = np.pad(mask, 4, mode="edge")
    cross, cube = ndimage.generate_binary_structure(3, 1), np.ones((3, 3, 3), dtype=bool)
    loose = np.zeros_like(mask)
    for side in (mask, ~mask):
        border = side & ndimage.binary_dilation(~side, cross)
        hard = border & ~ndimage.binary_dilation(side & ~border, cross)
        loose |= border & ~ndimage.binary_dilation(hard, cube)
    return loose[4:-4, 4:-4, 4:-4]


def margin(edge: ArrayLike, reach: float) -> Array:
    """(h, w) pixels from each pixel's centre to the nearest crossing of the G-buffer's edges (h, w, 2), at most `reach`."""
    crossing = np.asarray(edge, dtype=np.float64)
    y, x, side = np.nonzero(crossing >= 0)
    part = crossing[y, x, side]
    v, u = np.indices(crossing.shape[:2])
    if len(part) == 0:
        return np.full(u.shape, reach)
    far = np.hypot(u[..., None] - (x + part * (1 - side)), v[..., None] - (y + part * side)).min(axis=2)
    return np.minimum(far, reach)
