"""Benchmarks run as tests with timing off; `make bench` times them and keeps the figures in .benchmarks."""

from __future__ import annotations

from typing import Any

from intaglio.compute import thread_count


def pytest_benchmark_update_machine_info(machine_info: dict[str, Any]) -> None:
    """Figures depend on the number of threads, and on no one's host name."""
    machine_info["threads"] = thread_count()
    machine_info.pop("node", None)
