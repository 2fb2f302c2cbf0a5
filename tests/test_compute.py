"""Tiles, threads, progress, cancelling and the cache of compiled kernels."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import intaglio
from intaglio import InputError
from intaglio.compute import each, strips, thread_count, tiles

JOBS = [(i,) for i in range(50)]


@pytest.fixture(params=["1", "3"])
def threads(request, monkeypatch):
    monkeypatch.setenv("INTAGLIO_THREADS", request.param)
    return int(request.param)


@settings(deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 70), st.integers(0, 70), st.integers(1, 40))
def test_tiles_cover_every_pixel_once(threads, height, width, tile):
    count = np.zeros((height, width), dtype=np.int64)
    progress: list[tuple[int, int]] = []

    def visit(y0, y1, x0, x1, target):
        assert 0 < y1 - y0 <= tile
        assert 0 < x1 - x0 <= tile
        target[y0:y1, x0:x1] += 1

    tiles(visit, (height, width), count, tile=tile, progress=lambda done, total: progress.append((done, total)))
    assert (count == 1).all()
    total = -(-height // tile) * -(-width // tile)
    assert progress == [(i, total) for i in range(total + 1)]


@pytest.mark.parametrize(("length", "size"), [(0, 4), (1, 4), (8, 4), (9, 4), (5, 1)])
def test_strips_cover_a_range_once(threads, length, size):
    count = np.zeros(length, dtype=np.int64)

    def visit(begin, end, step):
        count[begin:end] += step

    strips(visit, length, 1, size=size)
    assert (count == 1).all()


def test_progress_comes_from_the_callers_thread(threads):
    seen = set()
    each(lambda _: None, JOBS, progress=lambda *_: seen.add(threading.current_thread()))
    assert seen == {threading.current_thread()}


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_exception_from_progress_stops(threads, error):
    many = [(i,) for i in range(400)]
    running, finished, cancelled = [], [], threading.Event()

    def job(i):
        running.append(i)
        if i >= 10:
            cancelled.wait()
        time.sleep(0.002)
        finished.append(i)

    def cancel(done, total):
        if done == 3:
            cancelled.set()
            raise error("enough")

    with pytest.raises(error, match="enough"):
        each(job, many, progress=cancel)
    begun = len(running)
    assert 3 <= begun < len(many)
    assert sorted(running) == sorted(finished)  # what has begun has ended
    time.sleep(0.02)
    assert len(running) == begun  # and nothing begins later
    again = []
    each(again.append, JOBS)  # the pool still works
    assert sorted(again) == [i for (i,) in JOBS]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_exception_from_a_job_is_raised(threads, error):
    def job(i):
        if i == 7:
            raise error("seven")
        time.sleep(0.001)

    with pytest.raises(error, match="seven"):
        each(job, JOBS)
    again = []
    each(again.append, JOBS)
    assert len(again) == len(JOBS)


def test_thread_count_follows_the_environment(monkeypatch):
    monkeypatch.setenv("INTAGLIO_THREADS", "5")
    assert thread_count() == 5
    monkeypatch.delenv("INTAGLIO_THREADS")
    assert 1 <= thread_count() <= (os.cpu_count() or 1)


@pytest.mark.parametrize("text", ["0", "-1", "two", "1.5", "²", " "])
def test_refuses_bad_thread_counts(monkeypatch, text):
    monkeypatch.setenv("INTAGLIO_THREADS", text)
    with pytest.raises(InputError, match=f"INTAGLIO_THREADS must be a positive number, not {text!r}"):
        each(lambda _: None, JOBS)


@pytest.fixture
def package(tmp_path):
    """A copy of the package with two kernels and a helper in a file of its own, so that its source can change."""
    source, copy = Path(intaglio.__file__).parent, tmp_path / "intaglio"
    copy.mkdir()
    for name in ("__init__.py", "errors.py", "compute.py"):
        shutil.copy(source / name, copy / name)
    (copy / "part.py").write_text("from intaglio.compute import helper\n@helper\ndef part(x):\n    return x + 1\n")
    (copy / "whole.py").write_text(
        "from intaglio.compute import kernel\nfrom intaglio.part import part\n"
        "@kernel\ndef twice(x):\n    return 2 * part(x)\n"
        "@kernel\ndef thrice(x):\n    return 3 * part(x)\n"
    )
    return tmp_path


def run_kernels(package: Path, cache: Path) -> tuple[int, int, int]:
    """In a fresh process: twice(1), thrice(1), and how often compilation was announced."""
    code = (
        "from intaglio.compute import announcing_compilation\nfrom intaglio.whole import twice, thrice\ncalls = []\n"
        "with announcing_compilation(lambda: calls.append(1)):\n    a, b = twice(1), thrice(1)\n    twice(1)\n"
        "print(a, b, len(calls))"
    )
    environment = {**os.environ, "PYTHONPATH": str(package), "XDG_CACHE_HOME": str(cache)}
    result = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    a, b, announced = result.stdout.split()
    return int(a), int(b), int(announced)


def test_compilation_is_announced_once_and_cached_until_the_source_changes(package, tmp_path):
    cache = tmp_path / "cache"
    assert run_kernels(package, cache) == (4, 6, 1)
    assert run_kernels(package, cache) == (4, 6, 0)
    part = package / "intaglio" / "part.py"
    part.write_text(part.read_text(encoding="utf-8").replace("x + 1", "x + 10"))
    assert run_kernels(package, cache) == (22, 33, 1)


def test_kernels_compile_where_no_cache_can_be_written(package, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert run_kernels(package, blocked) == (4, 6, 1)
