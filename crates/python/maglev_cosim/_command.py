"""The command `maglev`, which the package contains."""

import os
import subprocess
import sys
from pathlib import Path

#: The program.
PROGRAM = Path(__file__).parent / "bin" / ("maglev.exe" if os.name == "nt" else "maglev")


def main() -> None:
    """Becomes the program."""
    arguments = [str(PROGRAM), *sys.argv[1:]]
    if os.name == "nt":
        sys.exit(subprocess.run(arguments, check=False).returncode)
    os.execv(PROGRAM, arguments)
