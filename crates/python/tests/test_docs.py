"""The guide's page and the notebook, run as a reader would."""

import re
import subprocess
import sys

import nbformat
import pytest
from conftest import ROOT
from nbclient import NotebookClient


def test_issue_the_code_of_the_page_runs(tmp_path):
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE))
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert said[0].startswith("finished: gap ") and said[-1].startswith("help: ") or 'did you mean "ems_01"' in done.stdout


def test_issue_the_notebook_runs_and_shows_what_is_committed(tmp_path):
    """Every cell runs; what a run prints is what the committed notebook shows, pictures and progress aside."""
    path = ROOT / "examples" / "first-steps.ipynb"
    committed, notebook = (nbformat.read(path, 4) for _ in range(2))
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()

    for ours, theirs in zip(committed.cells, notebook.cells, strict=True):
        expected, found = shown(ours), shown(theirs)
        assert re.sub(NUMBER, "#", found) == re.sub(NUMBER, "#", expected), ours.source
        # what an optimiser finds may differ from machine to machine
        if "trial" not in ours.source:
            assert numbers(found) == pytest.approx(numbers(expected), rel=1e-3), ours.source
    said = next(shown(cell) for cell in notebook.cells if "optuna.create_study" in cell.source)
    before, after = re.search(r"least damping: (.*) before, (.*) after", said).groups()
    assert 0 < float(before) < float(after)


NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]\d+)?"


def numbers(text):
    return [float(it) for it in re.findall(NUMBER, text)]


def shown(cell):
    """What a cell prints and shows as text."""
    outputs = [it for it in cell.get("outputs", []) if it.get("name") != "stderr"]
    return "".join(it.get("text") or it["data"].get("text/plain", "") for it in outputs)
