"""Colours between two colours, as VTK's colour transfer functions mix them."""

# K. Moreland, "Diverging Color Maps for Scientific Visualization", ISVC 2009 (Msh).
# IEC 61966-2-1, 1999 (sRGB); CIE 15, 2004 (Lab, white D65).

from __future__ import annotations

import colorsys
import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_XYZ_FROM_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
_RGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
_WHITE = np.array([0.9505, 1.0, 1.089])


def _lab_from_rgb(rgb: Floats) -> Floats:
    linear = np.where(rgb > 0.04045, ((rgb + 0.055) / 1.055) ** 2.4, rgb / 12.92)
    t = linear @ _XYZ_FROM_RGB.T / _WHITE
    x, y, z = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def _rgb_from_lab(lab: Floats) -> Floats:
    """Rows (n, 3); what no screen shows is scaled to its brightest component, then cut at zero, as VTK does."""
    y = (lab[:, 0] + 16) / 116
    t = np.stack([lab[:, 1] / 500 + y, y, y - lab[:, 2] / 200], axis=1)
    xyz = np.where(t**3 > 0.008856, t**3, (t - 16 / 116) / 7.787) * _WHITE
    linear = xyz @ _RGB_FROM_XYZ.T
    rgb = np.where(linear > 0.0031308, 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055, 12.92 * linear)
    return np.maximum(rgb / np.maximum(rgb.max(axis=1, keepdims=True), 1.0), 0.0)


def _mixed_lab(a: Floats, b: Floats, t: Floats) -> Floats:
    return _rgb_from_lab((1 - t)[:, None] * _lab_from_rgb(a) + t[:, None] * _lab_from_rgb(b))


def _mixed_hsv(a: Floats, b: Floats, t: Floats, *, wrap: bool) -> Floats:
    """wrap: hue takes the shorter way round."""
    start, stop = (list(colorsys.rgb_to_hsv(*c.tolist())) for c in (a, b))
    if wrap and abs(start[0] - stop[0]) > 0.5:
        (start if start[0] > stop[0] else stop)[0] -= 1
    hsv = (1 - t)[:, None] * np.array(start) + t[:, None] * np.array(stop)
    return np.array([colorsys.hsv_to_rgb(h % 1, s, v) for h, s, v in hsv.tolist()])


def _msh(rgb: Floats) -> Floats:
    """Magnitude, saturation and hue: Lab in polar coordinates."""
    light, a, b = _lab_from_rgb(rgb)
    magnitude = math.hypot(light, a, b)
    saturation = math.acos(light / magnitude) if magnitude > 0.001 else 0.0
    return np.array([magnitude, saturation, math.atan2(b, a) if saturation > 0.001 else 0.0])


def _hue_beside(colour: Floats, magnitude: float) -> float:
    """The hue with which a grey of that magnitude fades to the colour without a bend in Lab."""
    m, s, h = colour.tolist()
    if m >= magnitude - 0.1:
        return float(h)
    spin = s * math.sqrt(magnitude**2 - m**2) / (m * math.sin(s))
    return float(h + spin if h > -0.3 * math.pi else h - spin)


def _mixed_diverging(a: Floats, b: Floats, t: Floats) -> Floats:
    """From colour to colour through a bright grey, if the hues differ much."""
    start, stop = _msh(a), _msh(b)
    apart = abs(start[2] - stop[2])
    if min(start[1], stop[1]) > 0.05 and min(apart, 2 * math.pi - apart) > 0.33 * math.pi:
        grey = np.array([max(start[0], stop[0], 88.0), 0.0, 0.0])
        first = _mixed_msh(start, grey, 2 * t[t < 0.5])
        return np.concatenate([first, _mixed_msh(grey, stop, 2 * t[t >= 0.5] - 1)])
    return _mixed_msh(start, stop, t)


def _mixed_msh(start: Floats, stop: Floats, t: Floats) -> Floats:
    start, stop = start.copy(), stop.copy()
    if start[1] < 0.05 < stop[1]:
        start[2] = _hue_beside(stop, start[0])
    elif stop[1] < 0.05 < start[1]:
        stop[2] = _hue_beside(start, stop[0])
    m, s, h = ((1 - t)[:, None] * start + t[:, None] * stop).T
    return _rgb_from_lab(np.stack([m * np.cos(s), m * np.sin(s) * np.cos(h), m * np.sin(s) * np.sin(h)], axis=1))


def mixed(a: Floats, b: Floats, t: Floats, space: str, *, hsv_wrap: bool = False) -> Floats:
    """Display colours (n, 3) at ascending parts t (n,) of the way from a to b; space is HSV, Lab or Diverging."""
    if space == "HSV":
        return _mixed_hsv(a, b, t, wrap=hsv_wrap)
    return _mixed_lab(a, b, t) if space == "Lab" else _mixed_diverging(a, b, t)
