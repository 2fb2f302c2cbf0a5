"""Focus and context from labels: liver and kidneys engraved, bones and skin as contours."""

from pathlib import Path

import numpy as np
from _scans import scan

import intaglio as ig

# Of the 117 classes: sacrum, vertebrae, humeri to clavicles, femora and hips, skull, ribs and their cartilage.
BONES = (*range(25, 51), *range(69, 79), *range(91, 117))


def make(data: Path | None, size: int) -> ig.Drawing:
    volume, real = scan(data, "ct_abdomen.nii.gz")
    if not real:
        iso, _ = ig.body_surface(volume)
        parts = [
            ig.Part(volume=volume, iso=iso, opacity=0.3, lines_only=True, name="skin"),
            ig.Part(volume=volume, iso=2.0 * iso, style="engraving", colour="#8a2b1a", name="inside"),
        ]
        return ig.illustrate(parts, camera=ig.parts_camera(parts, "anterior", size))
    labels, _ = scan(data, "ct_abdomen_labels.nii.gz")
    bones = tuple(np.intersect1d(labels.array, BONES).tolist())
    outline = ig.style("engraving", valley=1.5, contour=0.3)
    # A range, though it has no upper end: the thin cover of the table is no body then.
    parts = [
        ig.Part(volume=volume, iso=(-300.0, 4000.0), style=outline, opacity=0.25, lines_only=True, name="skin"),
        ig.Part(volume=labels, label=bones, style=outline, lines_only=True, colour="#4a4a48", name="bones"),
        ig.Part(volume=labels, label=(2, 3), style="pen-and-ink", colour="#7a4a12", name="kidneys"),
        ig.Part(volume=labels, label=5, style="engraving", colour="#8a2b1a", name="liver"),
    ]
    return ig.illustrate(parts, camera=ig.parts_camera(parts, (0.25, 1.0, 0.12), size))
