"""First hit of an isosurface per pixel: a G-buffer straight from the voxels, without polygons."""

# G. Kindlmann, R. Whitaker, T. Tasdizen, T. Moeller, "Curvature-based transfer functions for direct
# volume rendering: methods and applications", 2003.

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from intaglio.camera import Camera
from intaglio.compute import Progress, frozen, kernel, tiles
from intaglio.errors import InputError
from intaglio.gbuffer import GBuffer
from intaglio.lighting import DEFAULT_LIGHTS, Light, Material, packed_lights
from intaglio.rendering.cutting import cut_blocks, kept
from intaglio.rendering.first_hit import first_hit, ray_at
from intaglio.rendering.isovalue import body_side
from intaglio.rendering.skipping import Inside, surface_blocks
from intaglio.sampling import tricubic, trilinear
from intaglio.selection import Selection, packed_selections
from intaglio.volume import Volume, check_volume

# A jump of depth by less than this many voxels is not a contour.
MIN_JUMP = 1.5
# Percentiles of a body's values that are least, middling and most dense in a section, and how sparsely its voxels are asked.
WINDOW = (2.0, 50.0, 98.0)
SPARSE = 3


@kernel
def _trace(  # type: ignore[no-untyped-def]
    y0, y1, x0, x1, voxels, blocks, iso, sign, heads, data, index_rays, world_rays, to_world, lights, material,
    depth, normal, curvature, direction, view_curvature, light, section,
):  # fmt: skip
    nz, ny, nx = voxels.shape
    ray = np.empty(6)
    world = np.empty(6)
    d = np.empty(10)
    weights = np.empty((3, 3, 4))
    n = np.empty(3)
    u = np.empty(3)
    v = np.empty(3)
    hw = np.empty((3, 3))
    for py in range(y0, y1):
        for px in range(x0, x1):
            ray_at(index_rays, px + 0.5, py + 0.5, ray)
            t, inside = first_hit(voxels, blocks, iso, sign, heads, data, ray, 0.0)
            if t == np.inf:
                continue
            ray_at(world_rays, px + 0.5, py + 0.5, world)
            back = 1.0 / math.sqrt(world[3] ** 2 + world[4] ** 2 + world[5] ** 2)
            vx, vy, vz = -world[3] * back, -world[4] * back, -world[5] * back
            x, y, z = ray[0] + t * ray[3], ray[1] + t * ray[4], ray[2] + t * ray[5]
            length = math.sqrt(ray[3] ** 2 + ray[4] ** 2 + ray[5] ** 2)
            flat = inside
            if inside:
                # The scan ends inside the body: its face is the surface.
                a = min(abs(x), abs(nx - 1.0 - x))
                b = min(abs(y), abs(ny - 1.0 - y))
                c = min(abs(z), abs(nz - 1.0 - z))
                axis = 0 if a <= b and a <= c else (1 if b <= c else 2)
                n[0], n[1], n[2] = to_world[axis, 0], to_world[axis, 1], to_world[axis, 2]
                if n[0] * vx + n[1] * vy + n[2] * vz < 0.0:
                    n[0], n[1], n[2] = -n[0], -n[1], -n[2]
                slope = 0.0
                section[py, px] = trilinear(voxels, x, y, z)
            elif heads.shape[0] > 0 and kept(heads, data, x, y, z) < 0.02 / length:
                # A cut face: the tool's normal, turned out of the body.
                flat = True
                n[0] = n[1] = n[2] = 0.0
                for axis in range(3):
                    hx, hy, hz = 0.5 * (axis == 0), 0.5 * (axis == 1), 0.5 * (axis == 2)
                    g = kept(heads, data, x - hx, y - hy, z - hz) - kept(heads, data, x + hx, y + hy, z + hz)
                    for c in range(3):
                        n[c] += to_world[axis, c] * g
                slope = 0.0
                section[py, px] = trilinear(voxels, x, y, z)
            else:
                for _ in range(4):
                    tricubic(voxels, ray[0] + t * ray[3], ray[1] + t * ray[4], ray[2] + t * ray[5], weights, d)
                    # The B-spline smooths: f + laplace(f) / 6 + fourth order. Taking that away leaves the field itself.
                    value = d[0] - (d[4] + d[5] + d[6]) / 6.0
                    along = d[1] * ray[3] + d[2] * ray[4] + d[3] * ray[5]
                    if sign * along <= 0.0:
                        break
                    move = min(max((iso - value) / along, -0.25 / length), 0.25 / length)
                    t += move
                    if abs(move) * length < 0.02:
                        break
                # Gradient and Hessian in world space: g = M^T g', H = M^T H' M with M = index_from_world.
                for c in range(3):
                    n[c] = -sign * (to_world[0, c] * d[1] + to_world[1, c] * d[2] + to_world[2, c] * d[3])
                slope = math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
                if slope < 1e-30:
                    flat = True
                    n[0], n[1], n[2] = vx, vy, vz
            norm = 1.0 / max(math.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2), 1e-30)
            n[0], n[1], n[2] = n[0] * norm, n[1] * norm, n[2] * norm
            depth[py, px] = t
            for c in range(3):
                normal[py, px, c] = n[c]

            # A basis of the tangent plane (Duff et al. 2017).
            s = 1.0 if n[2] >= 0.0 else -1.0
            a = -1.0 / (s + n[2])
            b = n[0] * n[1] * a
            u[0], u[1], u[2] = 1.0 + s * n[0] * n[0] * a, s * b, -s * n[0]
            v[0], v[1], v[2] = b, s + n[1] * n[1] * a, -n[1]
            suu = suv = svv = 0.0
            if not flat:
                for c in range(3):
                    p0 = d[4] * to_world[0, c] + d[7] * to_world[1, c] + d[8] * to_world[2, c]
                    p1 = d[7] * to_world[0, c] + d[5] * to_world[1, c] + d[9] * to_world[2, c]
                    p2 = d[8] * to_world[0, c] + d[9] * to_world[1, c] + d[6] * to_world[2, c]
                    for r in range(3):
                        hw[r, c] = to_world[0, r] * p0 + to_world[1, r] * p1 + to_world[2, r] * p2
                for r in range(3):
                    for c in range(3):
                        suu -= u[r] * hw[r, c] * u[c]
                        suv -= u[r] * hw[r, c] * v[c]
                        svv -= v[r] * hw[r, c] * v[c]
                scale = sign / slope
                suu, suv, svv = suu * scale, suv * scale, svv * scale
            mean = 0.5 * (suu + svv)
            half = 0.5 * (suu - svv)
            root = math.sqrt(half * half + suv * suv)
            curvature[py, px, 0] = mean + root
            curvature[py, px, 1] = mean - root
            angle = 0.5 * math.atan2(suv, half)
            ca, sa = math.cos(angle), math.sin(angle)
            for c in range(3):
                direction[py, px, c] = ca * u[c] + sa * v[c]
            wu = vx * u[0] + vy * u[1] + vz * u[2]
            wv = vx * v[0] + vy * v[1] + vz * v[2]
            ww = wu * wu + wv * wv
            if ww > 1e-12:
                view_curvature[py, px] = (suu * wu * wu + 2.0 * suv * wu * wv + svv * wv * wv) / ww
            else:
                view_curvature[py, px] = mean + root

            light[py, px, 0] = material[0]
            diffuse = specular = 0.0
            for k in range(lights.shape[0]):
                lx, ly, lz = lights[k, 1], lights[k, 2], lights[k, 3]
                power = lights[k, 7]
                if lights[k, 0] > 0.5:
                    lx = lights[k, 4] - (world[0] + t * world[3])
                    ly = lights[k, 5] - (world[1] + t * world[4])
                    lz = lights[k, 6] - (world[2] + t * world[5])
                    far = 1.0 / max(math.sqrt(lx * lx + ly * ly + lz * lz), 1e-6)
                    lx, ly, lz = lx * far, ly * far, lz * far
                    if lights[k, 0] > 1.5:
                        cone = lx * lights[k, 1] + ly * lights[k, 2] + lz * lights[k, 3]
                        edge = min(max((cone - lights[k, 8]) / max(lights[k, 9] - lights[k, 8], 1e-6), 0.0), 1.0)
                        power *= edge * edge * (3.0 - 2.0 * edge)
                lit = n[0] * lx + n[1] * ly + n[2] * lz
                hx, hy, hz = lx + vx, ly + vy, lz + vz
                shine = (n[0] * hx + n[1] * hy + n[2] * hz) / max(math.sqrt(hx * hx + hy * hy + hz * hz), 1e-9)
                if material[4] > 0.5:
                    lit, shine = abs(lit), abs(shine)
                if lit > 0.0:
                    diffuse += power * lit
                    if shine > 0.0:
                        specular += power * shine ** material[3]
            light[py, px, 1] = material[1] * diffuse
            light[py, px, 2] = material[2] * specular


@kernel
def _edges(y0, y1, x0, x1, voxels, blocks, iso, sign, heads, data, index_rays, min_jump, depth, edge):  # type: ignore[no-untyped-def]
    h, w = depth.shape
    ray = np.empty(6)
    for py in range(y0, y1):
        for px in range(x0, x1):
            za = depth[py, px]
            for side in range(2):
                qx, qy = px + 1 - side, py + side
                if qx >= w or qy >= h:
                    continue
                zb = depth[qy, qx]
                if za == zb or abs(za - zb) < min_jump:
                    continue
                low, high = 0.0, 1.0
                ta, tb = float(za), float(zb)
                start = min(ta, tb) - 3.0 * min_jump
                for _ in range(6):
                    m = 0.5 * (low + high)
                    ray_at(index_rays, px + 0.5 + m * (1 - side), py + 0.5 + m * side, ray)
                    tm, inside = first_hit(voxels, blocks, iso, sign, heads, data, ray, max(start, 0.0))
                    # Towards the end whose depth it has less in common with.
                    if abs(tm - ta) < abs(tm - tb) or (tm == np.inf and ta == np.inf):
                        low = m
                        ta = tm
                    else:
                        high = m
                        tb = tm
                    if abs(ta - tb) < min_jump:
                        break
                if abs(ta - tb) >= min_jump:
                    edge[py, px, side] = 0.5 * (low + high)


def _window(volume: Volume, iso: float) -> tuple[float, float]:
    """The values between which nearly all of a body's lie; even matter is in the middle."""
    values = volume.samples[::SPARSE, ::SPARSE, ::SPARSE]
    values = values[values > iso]
    low, middle, high = np.percentile(values, WINDOW) if values.size else (iso, iso, iso)
    high = max(high, 2.0 * middle - low)
    return (float(low), float(high)) if high > low else (float(low) - 1.0, float(low) + 1.0)


def isosurface(
    volume: Volume,
    iso: float,
    camera: Camera,
    *,
    lights: Sequence[Light] = DEFAULT_LIGHTS,
    material: Material | None = None,
    inside: Inside | None = None,
    islands: float = 0.0,
    selections: Sequence[Selection] = (),
    progress: Progress | None = None,
) -> GBuffer:
    """The surface where the volume has the value `iso`, as the camera sees it.

    inside   on which side of the isovalue the body is, "above" or "below"; default: above, but below in distances
    islands  pieces smaller than this part of the largest one are left out (see `surface_blocks`)
    selections  tools that cut the body open; cut faces have the tools' normals
    Returns a GBuffer of camera.size. The hit is that of the field through the voxels to fourth order in
    their spacing; normal and curvatures come from the tricubic B-spline at the hit, curvature by
    G = -P H P / |g| in the tangent plane, solved exactly (Kindlmann et al. 2003). Where the scan ends inside
    the body, its face is drawn. Where depth jumps between pixels, the place is found to 1/64 pixel.
    Raises InputError if iso is outside the volume's values, or the camera inside the volume.
    """
    check_volume(volume)
    low, high = volume.range
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"{volume.name}: voxels are NaN or infinite; replace them with fill=VALUE when reading")
    if low == high:
        raise InputError(f"{volume.name}: every voxel is {low:g}, so it has no surface; is this the right file?")
    if not low < iso <= high:
        raise InputError(f"{volume.name}: iso must be within the volume's values, above {low:g} up to {high:g}, not {iso:g}")
    inside = body_side(volume, inside)
    eye = volume.index_from_world[:3, :3] @ camera.eye + volume.index_from_world[:3, 3]
    if ((eye >= 0) & (eye <= np.array(volume.shape[::-1]) - 1)).all():
        raise InputError(f"{volume.name}: the camera is inside the volume; move it out, at a larger distance")

    material = material or Material()
    gb = GBuffer.empty(camera)
    world_rays = camera.rays()
    index_rays = world_rays @ volume.index_from_world[:3, :3].T
    index_rays[0] += volume.index_from_world[:3, 3] if camera.projection == "orthographic" else 0.0
    if camera.projection == "perspective":
        index_rays[0] = eye
    sign = 1.0 if inside == "above" else -1.0
    heads, data = packed_selections(selections, volume)
    blocks = cut_blocks(volume, surface_blocks(volume, iso, islands, inside), heads)
    field = (frozen(volume.samples), frozen(blocks), float(iso), sign, heads, data, index_rays)
    shading = np.array([material.ambient, material.diffuse, material.specular, material.shininess, material.two_sided])
    shape = gb.depth.shape
    tiles(
        _trace, shape, *field, world_rays, volume.index_from_world[:3, :3].copy(), packed_lights(lights, camera), shading,
        gb.depth, gb.normal, gb.curvature, gb.direction, gb.view_curvature, gb.light, gb.section, progress=progress,
    )  # fmt: skip
    if not np.isnan(gb.section).all():
        if inside == "above":
            low, high = _window(volume, iso)
            gb.section[:] = np.clip((gb.section - low) / (high - low), 0.0, 1.0)
        else:
            # Distances say nothing of what is cut.
            gb.section[~np.isnan(gb.section)] = 0.5
    tiles(_edges, shape, *field, MIN_JUMP * float(volume.spacing.max()), gb.depth, gb.edge)
    return gb
