"""The package's frame: what importing costs, which way imports go, how large modules are."""

from __future__ import annotations

import ast
import importlib
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import intaglio

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "intaglio"
SOURCES = {".".join(p.relative_to(PACKAGE).with_suffix("").parts).removesuffix(".__init__"): p for p in PACKAGE.rglob("*.py")}
MODULES = {name: path for name, path in SOURCES.items() if name != "__init__"}

NOUNS = (
    "volume",
    "mesh",
    "selection",
    "camera",
    "piecewise",
    "transfer_presets",
    "transfer_function",
    "transfer_function_2d",
    "lighting",
    "gbuffer",
    "brush",
    "drawing",
)
SIBLINGS = ("io", "rendering", "ink", "solid")
PIPELINES = 4
LAYER = {
    "errors": 0,
    **dict.fromkeys(NOUNS, 1),
    "compute": 2,
    "sampling": 2,
    **dict.fromkeys(SIBLINGS, 3),
    "datasets": 5,
    "cli": 6,
    "__main__": 7,
}

# Drawings, meshes and transfer functions save and show themselves, though what writes files stands above them.
DOORS = {
    ("drawing", "Drawing.save"),
    ("drawing", "Drawing.image"),
    ("drawing", "Drawing._repr_svg_"),
    ("drawing", "Image.save"),
    ("drawing", "Image._repr_png_"),
    ("mesh", "TriangleMesh.save"),
    ("transfer_function", "TransferFunction.read"),
    ("transfer_function", "TransferFunction.write"),
    ("transfer_function", "TransferFunction.picture"),
}

Import = ast.Import | ast.ImportFrom


def imports(tree: ast.AST, scope: str = "") -> Iterator[tuple[str, Import]]:
    """Every import statement with the dotted name of the function it stands in."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, Import):
            yield scope, node
        elif isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield from imports(node, f"{scope}.{node.name}".lstrip("."))
        else:
            yield from imports(node, scope)


def imported_modules(node: Import) -> set[str]:
    """Modules of the package that a statement loads, without the package's name; public names count as their module."""
    if isinstance(node, ast.Import):
        names = [alias.name for alias in node.names]
        return {name.removeprefix("intaglio.") for name in names if name.startswith("intaglio.")}
    assert node.level == 0, f"line {node.lineno}: imports are absolute"
    if node.module is None or node.module.split(".")[0] != "intaglio":
        return set()
    inside = node.module.removeprefix("intaglio").lstrip(".")
    found = set()
    for alias in node.names:
        full = f"{inside}.{alias.name}".lstrip(".")
        if full in MODULES:
            found.add(full)
        elif inside:
            found.add(inside)
        elif alias.name != "__version__":
            found.add(intaglio._PUBLIC[alias.name])
    return found


def allowed(importer: str, imported: str) -> bool:
    part, other = importer.partition(".")[0], imported.partition(".")[0]
    above, below = LAYER.get(part, PIPELINES), LAYER.get(other, PIPELINES)
    return below < above or (below == above and (part == other or above != LAYER["io"]))


def dependencies() -> dict[str, set[str]]:
    """Module to the modules it imports, doors left out."""
    graph: dict[str, set[str]] = {}
    for name, path in MODULES.items():
        found = (
            imported_modules(node)
            for scope, node in imports(ast.parse(path.read_text(encoding="utf-8")))
            if (name, scope) not in DOORS
        )
        graph[name] = set().union(*found)
    return graph


def test_imports_go_downwards():
    wrong = [f"{a} imports {b}" for a, found in dependencies().items() for b in found if not allowed(a, b)]
    assert wrong == []


def test_imports_have_no_cycle():
    assert list(TopologicalSorter(dependencies()).static_order())


@pytest.mark.parametrize(
    ("importer", "imported", "verdict"),
    [
        ("volume", "errors", True),
        ("gbuffer", "camera", True),
        ("io.svg", "io.outline", True),
        ("plate", "rendering.isosurface", True),
        ("cli", "datasets", True),
        ("volume", "compute", False),
        ("ink.strokes", "rendering.sampling", False),
        ("io.svg", "plate", False),
        ("plate", "datasets", False),
        ("datasets", "cli", False),
    ],
)
def test_the_rule_can_fail(importer, imported, verdict):
    assert allowed(importer, imported) is verdict


def test_doors_are_in_use():
    used = {
        (name, scope)
        for name in {name for name, _ in DOORS}
        for scope, node in imports(ast.parse(MODULES[name].read_text(encoding="utf-8")))
        if not all(allowed(name, other) for other in imported_modules(node))
    }
    assert used == DOORS


def test_only_compute_knows_numba_and_pools():
    users = {
        name
        for name, path in MODULES.items()
        for _, node in imports(ast.parse(path.read_text(encoding="utf-8")))
        for loaded in ([alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""])
        if loaded.split(".")[0] in ("numba", "concurrent", "multiprocessing")
    }
    assert users <= {"compute"}


def test_bare_import_loads_numpy_at_most(record_property):
    code = (
        "import json, sys, time\nbefore = set(sys.modules)\nbegin = time.perf_counter()\nimport intaglio\n"
        "print(json.dumps([time.perf_counter() - begin, sorted({m.split('.')[0] for m in set(sys.modules) - before})]))"
    )
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    seconds, loaded = json.loads(output)
    record_property("import_seconds", seconds)
    assert set(loaded) - set(sys.stdlib_module_names) <= {"intaglio", "numpy"}


def test_nouns_load_numpy_only():
    code = (
        f"import sys\nimport {', '.join(f'intaglio.{noun}' for noun in NOUNS)}\nprint(*{{m.split('.')[0] for m in sys.modules}})"
    )
    output = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not set(output.split()) & {"numba", "scipy", "SimpleITK", "trimesh", "PIL", "fpdf", "typer", "rich"}


@pytest.mark.parametrize("name", intaglio.__all__)
def test_public_names_resolve(name):
    value = getattr(intaglio, name)
    assert value is getattr(importlib.import_module(f"intaglio.{intaglio._PUBLIC[name]}"), name)
    assert name in dir(intaglio)
    assert value.__doc__


def test_public_names_are_known_to_type_checkers():
    tree = ast.parse((PACKAGE / "__init__.py").read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {alias.asname: node.module for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert typed == {name: f"intaglio.{module}" for name, module in intaglio._PUBLIC.items()}


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="module 'intaglio' has no attribute 'mezzotint'"):
        intaglio.__getattr__("mezzotint")


@pytest.mark.parametrize("name", sorted(SOURCES))
def test_modules_stay_small(name):
    assert SOURCES[name].stat().st_size <= 15 * 1024


def test_no_file_names_somebodys_machine():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    home = re.compile(rb"(?<![\w.])(/(home|Users|root|work|mnt)/\w|[A-Z]:\\Users\b)")
    files = [ROOT / name for name in listed.stdout.split("\0") if name]
    found = [
        f"{path.relative_to(ROOT)}: {m[0].decode()}" for path in files if path.is_file() for m in home.finditer(text_of(path))
    ]
    assert found == []


def text_of(path: Path) -> bytes:
    """The file's bytes; none of them where it is not text."""
    content = path.read_bytes()
    return b"" if b"\0" in content else content
