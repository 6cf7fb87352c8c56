"""python3 -m sidewall ...: the program itself, on the same command line."""

import os
import shutil
import sys
from pathlib import Path


def program():
    """The program of this package's own installation, else the first one in PATH."""
    for folder in Path(__file__).resolve().parents:
        found = shutil.which("sidewall", path=folder / "bin")
        if found:
            return found
    return shutil.which("sidewall")


path = program()
if path is None:
    sys.exit("sidewall: the program is not installed beside this module, nor in PATH")
os.execv(path, ["sidewall", *sys.argv[1:]])
