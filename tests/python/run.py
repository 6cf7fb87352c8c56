"""run.py ARGS: pytest ARGS, or a word why not, and exit code 77."""

import importlib.util
import sys

missing = [name for name in ("numpy", "pytest") if importlib.util.find_spec(name) is None]
if missing:
    print("skipped: Python has no " + " and no ".join(missing))
    sys.exit(77)

import pytest

sys.exit(pytest.main(["-p", "no:cacheprovider", *sys.argv[1:]]))
