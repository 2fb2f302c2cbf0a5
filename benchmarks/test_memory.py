"""Peak memory of a plate from a 512 cubed int16 scan, in a process of its own."""

from __future__ import annotations

import subprocess
import sys

import numpy as np

SCRIPT = """
import sys
import intaglio as ig
volume = ig.read_volume(sys.argv[1])
ig.hatch(volume, iso=300.0, style="pen-and-ink").save(sys.argv[2])
# Not ru_maxrss, which a child inherits from the process that forked it.
print(next(line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")))
"""


def test_peak_memory_of_a_large_scan(benchmark, tmp_path):
    import SimpleITK as sitk

    n = 512
    axis = np.linspace(-1, 1, n, dtype=np.float32)
    plane = axis[:, None] ** 2 + axis[None] ** 2
    array = np.empty((n, n, n), dtype=np.int16)
    for k, z in enumerate(axis):
        array[k] = 1000 - 1400 * np.sqrt(plane + z * z) + 60 * np.sin(40 * plane)
    path = tmp_path / "large.nii"
    sitk.WriteImage(sitk.GetImageFromArray(array), str(path))
    size = array.nbytes
    del array

    def run():
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT, str(path), str(tmp_path / "plate.svg")], capture_output=True, text=True, check=True
        )
        return int(done.stdout) * 1024

    run()
    peak = benchmark.pedantic(run, rounds=1)
    benchmark.extra_info |= {"peak bytes": peak, "times the data": peak / size}
    assert peak < 2.5 * size
