#!/usr/bin/env python3
"""Computes one point for Dakota: `driver.py PARAMETERS RESULTS`.

The descriptors of the variables name parameters as `maglev run --set` does, those of the responses name `objectives` or
`limits` of scenario.json. A run that fails is reported to Dakota as FAIL.
"""

import json
import subprocess
import sys
from pathlib import Path


def read(path):
    """The variables and the names of the responses in a parameters file of the standard format."""
    lines = [line.split() for line in Path(path).read_text().splitlines() if line.strip()]
    count = next(k for k, line in enumerate(lines) if line[-1] == "variables")
    n = int(lines[count][0])
    variables = {name: value for value, name in lines[count + 1 : count + 1 + n]}
    start = next(k for k, line in enumerate(lines) if line[-1] == "functions")
    m = int(lines[start][0])
    # such a line is: 1 ASV_1:deflection
    responses = [line[1].split(":", 1)[1] for line in lines[start + 1 : start + 1 + m]]
    return variables, responses


def main(parameters, results):
    variables, responses = read(parameters)
    options = [option for name, value in variables.items() for option in ("--set", f"{name}={value}")]
    done = subprocess.run(
        ["maglev", "run", "scenario.json", "--out", "run", "--no-report", "--quiet", *options]
    )
    figures = {}
    if done.returncode == 0:
        figures = json.loads(Path("run/metrics.json").read_text())
    values = [figures.get(name) for name in responses]
    if None in values:
        text = "FAIL\n"
    else:
        text = "".join(f"{value!r} {name}\n" for name, value in zip(responses, values))
    Path(results).write_text(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
