"""Recorded sessions as rows of figures, as they were or as other profiles would plan the same hands.

`score` makes the row of a session; the command `steadyhand score` does that for many sessions, side by side or on a cluster
(docs/how-to/record-data.md).
"""

from ._scores import RECORDED, Score, score, table

__all__ = ["RECORDED", "Score", "score", "table"]
