"""Points of the named transfer functions: value, colour, opacity of a millimetre."""

from __future__ import annotations

Points = tuple[tuple[float, str, float], ...]

# Hounsfield units: air -1000, fat -100..-50, water 0, muscle 40..60, vessels with contrast 150..400, cortical bone from 600.
CT_PRESETS: dict[str, Points] = {
    "ct-skin": ((-600, "#c98f72", 0.0), (-300, "#dba988", 0.45), (-100, "#ecc3a3", 0.85), (200, "#f3d7bf", 0.95)),
    "ct-muscle": (
        (-140, "#e8c98f", 0.0),
        (-80, "#e8c98f", 0.01),
        (-20, "#c4604f", 0.01),
        (50, "#b04438", 0.5),
        (90, "#bd5545", 0.45),
        (160, "#dcb592", 0.3),
        (350, "#f1e3c6", 0.85),
        (1500, "#fffaf0", 0.95),
    ),
    "ct-bone": ((120, "#b98a63", 0.0), (220, "#dcbb93", 0.25), (400, "#f0e2c4", 0.8), (1200, "#fffaf0", 0.95)),
    "ct-vessel": (
        (110, "#7a1512", 0.0),
        (180, "#b0241c", 0.35),
        (320, "#d94f3d", 0.7),
        (480, "#ead2ab", 0.75),
        (1500, "#fffaf0", 0.9),
    ),
    # Three hills, each rising from nothing: skin as a veil, muscle and organs, bone.
    "ct-tissues": (
        (-500, "#e8b796", 0.0),
        (-300, "#f0c8a8", 0.12),
        (-150, "#f0d0a8", 0.0),
        (0, "#cc6350", 0.0),
        (50, "#bd4a3c", 0.04),
        (110, "#c4604c", 0.0),
        (150, "#e0c8a0", 0.0),
        (350, "#f6ecd6", 0.7),
        (1500, "#fffaf0", 0.95),
    ),
}

# Parts of the data's range: MR has no unit.
MR_PRESETS: dict[str, Points] = {
    "mr-default": (
        (0.0, "#000000", 0.0),
        (0.08, "#8a5d4c", 0.0),
        (0.2, "#c08a70", 0.15),
        (0.45, "#e4c4ae", 0.4),
        (1.0, "#fff8ee", 0.9),
    ),
    # Made for T1: fluid is dark, then come grey and white matter, and fat, of which a veil remains.
    "mr-brain": (
        (0.2, "#a0685c", 0.0),
        (0.34, "#c8948a", 0.3),
        (0.46, "#efd8c8", 0.85),
        (0.56, "#f6ebdc", 0.85),
        (0.68, "#f8efdf", 0.02),
        (1.0, "#fff8ee", 0.02),
    ),
    "mr-angiography": ((0.3, "#7a1512", 0.0), (0.55, "#cf3d2f", 0.5), (1.0, "#ffe9d6", 0.95)),
}
