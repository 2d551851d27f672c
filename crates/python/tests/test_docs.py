"""The guide's page and the notebook, run as a reader would."""

import re
import subprocess
import sys

from conftest import ROOT


def test_issue_the_code_of_the_page_runs(tmp_path):
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    code = "\n".join(re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE))
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    said = done.stdout.splitlines()
    assert said[0].startswith("finished: gap ") and said[-1].startswith("help: ") or 'did you mean "ems_01"' in done.stdout
