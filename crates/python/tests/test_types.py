"""Types and documentation: the package passes its own check, and the stub of the native module tells the truth."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import maglev_cosim
from maglev_cosim import _native

SETTINGS = Path(__file__).parent / "mypy.ini"


def test_issue_the_package_is_typed(tmp_path):
    check = [sys.executable, "-m", "mypy", "--config-file", SETTINGS, "--package", "maglev_cosim"]
    done = subprocess.run(check, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr


def parameters(function):
    """Names of the parameters in a stub, each with whether it has a default."""
    it = function.args
    given = it.posonlyargs + it.args
    plain = [(each.arg, False) for each in given[: len(given) - len(it.defaults)]]
    return [each for each in plain + [(each.arg, True) for each in given[len(plain) :]] if each[0] != "self"]


def test_invariant_the_stub_has_what_the_native_module_has():
    stub = ast.parse((Path(_native.__file__).parent / "_native.pyi").read_text())
    found = {}
    for node in stub.body:
        if isinstance(node, ast.ClassDef):
            found[node.name] = None
            found |= {f"{node.name}.{it.name}": it for it in node.body}
        elif isinstance(node, ast.FunctionDef):
            found[node.name] = node
    there = {}
    for name, it in vars(_native).items():
        if inspect.isclass(it):
            there |= {name: it} | {f"{name}.{key}": getattr(it, key) for key in vars(it) if not key.startswith("__")}
        elif callable(it) and not name.startswith("__"):
            there[name] = it
    plain = {name for name in found if "__" not in name}
    assert plain == set(there)
    for name in plain:
        if inspect.isroutine(there[name]):
            signature = inspect.signature(there[name]).parameters.values()
            expected = [(it.name, it.default is not it.empty) for it in signature if it.name != "self"]
            assert parameters(found[name]) == expected, name


def test_issue_everything_public_is_documented():
    for name in maglev_cosim.__all__:
        it = getattr(maglev_cosim, name)
        assert it.__doc__, name
        for key, member in vars(it).items() if isinstance(it, type) else ():
            if not key.startswith("_") and callable(member):
                assert member.__doc__, f"{name}.{key}"
