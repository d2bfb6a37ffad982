"""Recorded sessions as a data set for imitation learning, in LeRobot's format v3.0.

`cut` makes episodes of a session, `write` a data set of episodes, `merge` one of several; the command `steadyhand dataset` does all
that for many sessions (docs/datasets.md). Needs pandas and pyarrow, and for videos av and mcap: pip install steadyhand[dataset].
"""

from ._episodes import ACTIONS, Episode, Frames, cut
from ._lerobot import write
from ._merge import merge
from ._video import Film, Video, read_videos

__all__ = ["ACTIONS", "Episode", "Film", "Frames", "Video", "cut", "merge", "read_videos", "write"]
