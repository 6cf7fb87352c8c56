"""Recipes from files, texts and dicts."""

import json
import os
import re
import tomllib

from ._sidewall import ReadRecipe


def _toml(value):
    """Returns a value as TOML on one line."""
    if hasattr(value, "tolist"):  # a NumPy array or number
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (str, os.PathLike)):
        return json.dumps(os.fspath(value), ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_toml(str(key))} = {_toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_toml, value)) + "]"
    raise TypeError(f"a recipe holds numbers, strings, lists and dicts, no {type(value).__name__}: {value!r}")


def _named(steps, name):
    """Returns all steps of that name, also in loops."""
    return [found for step in steps for found in
            [step] * (step.get("name") == name) + _named(step.get("steps", []), name)]


class Recipe:
    """A recipe, read and checked as the program does it.

    source: a path, TOML text of several lines, or a dict of the recipe's sections such as
    {"domain": {...}, "layer": [{...}], "step": [{...}]}. settings: dict of keys to change, such as {"flux.rays": 1e5}.

    recipe["flux.rays"], recipe["step[0].duration"] or recipe["step.etch.duration"] (the step named etch) returns the value
    in use, defaults included; an assignment changes it, with the checks and messages of --set. str(recipe) is the effective
    recipe; notes is a list of remarks on it.

    Raises RecipeError with file, line and remedy; FileError for a file that cannot be read.
    """

    def __init__(self, source, settings=None):
        if isinstance(source, dict):
            text = "".join(f"{_toml(str(key))} = {_toml(value)}\n" for key, value in source.items())
            self._read_with = lambda changes: ReadRecipe.parse(text, "recipe", changes)
        elif isinstance(source, str) and "\n" in source:
            self._read_with = lambda changes: ReadRecipe.parse(source, "recipe", changes)
        else:
            path = os.fspath(source)
            self._read_with = lambda changes: ReadRecipe.load(path, changes)
        self._take([f"{key}={_toml(value)}" for key, value in (settings or {}).items()])

    def _take(self, changes):
        self._read = self._read_with(changes)  # raises before this recipe has changed
        self._changes = changes
        self._values = tomllib.loads(self._read.effective)

    def __setitem__(self, key, value):
        self._take([*self._changes, f"{key}={_toml(value)}"])

    def __getitem__(self, key):
        value = self._values
        try:
            for quoted, name, index in re.findall(r"[\"']([^\"']*)[\"']|([\w-]+)|\[(\d+)\]", key):
                if not index and value is self._values["step"]:
                    (value,) = _named(value, name or quoted)  # ValueError unless exactly one; --set below then lists the names
                else:
                    value = value[int(index)] if index else value[name or quoted]
            return value
        except (KeyError, IndexError, TypeError, ValueError):
            self._read_with([*self._changes, f"{key}=0"])  # raises for a key that no recipe has
            return None  # a key without a value

    @property
    def notes(self):
        return self._read.notes

    def __str__(self):
        return self._read.effective

    def __repr__(self):
        steps = [step.get("name") or step.get("model", "loop") for step in self._values["step"]]
        return f"<sidewall.Recipe: {', '.join(steps)}>"
