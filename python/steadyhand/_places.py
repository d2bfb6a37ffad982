"""Tells the library where Python packages are: URDFs and meshes come with airo-models."""

from importlib.util import find_spec
from pathlib import Path

from . import _native


def _folder_of(package: str) -> Path | None:
    spec = find_spec(package)
    return Path(spec.origin).parents[1] if spec is not None and spec.origin is not None else None


if (folder := _folder_of("airo_models")) is not None:
    _native.add_packages(str(folder))
