"""Recorded sessions as a data set for imitation learning, in LeRobot's format v3.0.

`cut` makes episodes of a session, `write` a data set of episodes; the command `steadyhand dataset` does both for many sessions
(docs/datasets.md). Needs pandas and pyarrow, and for videos av and mcap: pip install steadyhand[dataset].
"""

from ._episodes import ACTIONS, Episode, Frames, cut
from ._lerobot import write
from ._video import Film, Video, read_videos

__all__ = ["ACTIONS", "Episode", "Film", "Frames", "Video", "cut", "read_videos", "write"]
