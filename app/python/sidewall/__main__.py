"""Runs the program: python3 -m sidewall ... takes the same command line as sidewall."""

import os
import shutil
import sys
from pathlib import Path


def program():
    """Returns the path of the program installed with this package, else of the first one in PATH."""
    for folder in Path(__file__).resolve().parents:
        found = shutil.which("sidewall", path=folder / "bin")
        if found:
            return found
    return shutil.which("sidewall")


path = program()
if path is None:
    sys.exit("sidewall: the program is not installed beside this module, nor in PATH")
os.execv(path, ["sidewall", *sys.argv[1:]])
