import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import raylign
from raylign import _native

STUB = ast.parse((Path(raylign.__file__).parent / "_native.pyi").read_text())


def public(names):
    return {name for name in names if not name.startswith("__") or name == "__version__"}


def declared(body):
    named = {node.name for node in body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    return public(named | {node.target.id for node in body if isinstance(node, ast.AnnAssign)})


def test_type_checkers_are_told_what_there_is():
    assert {name for name in declared(STUB.body) if not name.startswith("_") or name == "__version__"} == public(dir(_native))
    for node in STUB.body:
        if not isinstance(node, ast.ClassDef) or issubclass(getattr(_native, node.name), BaseException):
            continue
        there = {name for name in vars(getattr(_native, node.name)) if not name.startswith("__")}
        told = {name for name in declared(node.body) if name != "notes"}  # set by read_volume
        assert told == there, node.name


# Of pybind11's making: a metaclass of its own, and constructors of classes that only raylign makes.
NOT_FAULTS = r"""raylign\._native\.(Backend|Result|Session|TrackFrame|Tracker|View|Volume)
raylign\._native\.(Result|TrackFrame)\.__init__
"""


def test_mypy_finds_the_stubs_as_the_module_is(tmp_path):
    pytest.importorskip("mypy")
    (tmp_path / "allowed").write_text(NOT_FAULTS)
    package = str(Path(raylign.__file__).parents[1])
    done = subprocess.run([sys.executable, "-m", "mypy.stubtest", "raylign._native", "--allowlist", "allowed", "--ignore-unused-allowlist"],
                          cwd=tmp_path, env={**os.environ, "MYPYPATH": package}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_mypy_finds_nothing_to_say_of_the_package_when_strict(tmp_path):
    """As pyproject.toml asks it: what users' type checkers see."""
    pytest.importorskip("mypy")
    done = subprocess.run([sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path)], cwd=Path(__file__).parents[2], capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_what_is_offered_is_there_and_documented():
    for name in raylign.__all__:
        assert hasattr(raylign, name), name
    for function in (raylign.register, raylign.track, raylign.read_volume, raylign.read_views, raylign.drr, raylign.line_integral):
        assert function.__doc__
