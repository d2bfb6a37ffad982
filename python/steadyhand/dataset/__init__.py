"""Recorded sessions as a data set for imitation learning, in LeRobot's format v3.0.

`cut` makes episodes of a session, `write` a data set of episodes, `merge` one of several; the command `steadyhand dataset` does all
that for many sessions (docs/how-to/record-data.md). Needs pandas and pyarrow, and for videos av: the extra [dataset].
"""

from typing import TYPE_CHECKING, Any

from ._episodes import ACTIONS, Episode, Frames, cut
from ._video import Film, Video, read_videos

if TYPE_CHECKING:
    from ._lerobot import write
    from ._merge import merge

__all__ = ["ACTIONS", "Episode", "Film", "Frames", "Video", "cut", "merge", "read_videos", "write"]


def __getattr__(name: str) -> Any:
    """What needs packages of the extra `dataset`: without them the rest works."""
    if name == "write":
        from ._lerobot import write

        return write
    if name == "merge":
        from ._merge import merge

        return merge
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
