"""Recorded sessions as a data set for imitation learning, in LeRobot's format v3.0.

`cut` makes episodes of a session, `write` a data set of episodes; the command `steadyhand dataset` does both for many sessions
(docs/datasets.md). Needs pandas and pyarrow: pip install steadyhand[dataset].
"""

from ._episodes import ACTIONS, Episode, Frames, cut
from ._lerobot import write

__all__ = ["ACTIONS", "Episode", "Frames", "cut", "write"]
