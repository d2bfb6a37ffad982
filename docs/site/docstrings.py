"""Docstrings as mkdocstrings shows them: examples are code, and pages are links."""

import re

import griffe


class Docstrings(griffe.Extension):
    def on_object(self, *, obj, **_):
        if obj.docstring:
            text = re.sub(r"(?m)^((?:(?:>>>|\.\.\.).*\n?)+)", lambda found: "\n" + re.sub(r"(?m)^(?=.)", "    ", found[1]), obj.docstring.value)
            obj.docstring.value = re.sub(r"docs/([\w-]+/)([\w-]+)\.md", r"[\2](../\1\2.md)", text)

    def on_module_members(self, *, mod, **_):
        self.on_object(obj=mod)
