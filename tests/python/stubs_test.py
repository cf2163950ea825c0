import ast
from pathlib import Path

import raylign
from raylign import _native

STUB = ast.parse((Path(raylign.__file__).parent / "_native.pyi").read_text())


def public(names):
    return {name for name in names if not name.startswith("__") or name == "__version__"}


def declared(body):
    named = {node.name for node in body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    return public(named | {node.target.id for node in body if isinstance(node, ast.AnnAssign)})


def test_type_checkers_are_told_what_there_is():
    assert declared(STUB.body) == public(dir(_native))
    for node in STUB.body:
        if not isinstance(node, ast.ClassDef) or issubclass(getattr(_native, node.name), BaseException):
            continue
        there = {name for name in vars(getattr(_native, node.name)) if not name.startswith("__")}
        told = {name for name in declared(node.body) if name != "notes"}  # set by read_volume
        assert told == there - {"_repr_html_"}, node.name


def test_what_is_offered_is_there_and_documented():
    for name in raylign.__all__:
        assert hasattr(raylign, name), name
    for function in (raylign.register, raylign.track, raylign.read_volume, raylign.read_views, raylign.drr, raylign.line_integral):
        assert function.__doc__
