"""Recorded hands, split into those that weights and filters were found on and those that they are judged on.

The npm package super-hands has 15 recordings of gestures and walks, both hands, and some of demos: every second of the former (by name)
is for training, with its two hands, all others judge. Hands of other files are judged, unless they are named by --train.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import steadyhand

BUNDLED = Path(__file__).resolve().parents[1] / ".deps/node_modules/super-hands"
RECORDINGS = "machinima_tests/recordings/*.json", "examples/*/demo-recording.json"
REACH = 0.35  # m, that the arm goes to any side of where it begins
SCALE = 0.5  # at most, of the tool's motion for the hand's


@dataclass(frozen=True)
class RecordedHand:
    name: str
    path: str
    track: str
    training: bool
    until: float  # s
    scale: float  # SCALE, or less where the hand goes further than the arm reaches

    def read(self):
        return steadyhand.read_recording(self.path, track=self.track, until=self.until)


def fitting_scale(positions):
    """So that the tool stays within REACH of where it begins."""
    return min(SCALE, REACH / np.linalg.norm(positions - positions[0], axis=1).max())


def _tracks(path):
    return ("",) if path.suffix == ".csv" else ("lhand", "rhand")


def find_hands(paths=(), train=(), seconds=20.0):
    """Those of the files, or all of the package; the hands that do not move are left out."""
    gestures = sorted(BUNDLED.glob(RECORDINGS[0]))
    paths = [Path(path) for path in paths] or [*gestures, *sorted(BUNDLED.glob(RECORDINGS[1]))]
    training = {*gestures[::2], *(Path(path) for path in train)}
    found = []
    for path in paths:
        for track in _tracks(path):
            try:
                hand = steadyhand.read_recording(path, track=track, until=seconds)
            except steadyhand.SteadyhandError:
                continue  # has no such hand
            positions = np.asarray(hand.T_operator_hand)[:, :3, 3]
            if len(hand.t) < 300 or positions.std(0).max() < 0.01:
                continue
            stem = path.parent.name if path.stem == "demo-recording" else path.stem
            found.append(RecordedHand(f"{stem} {track}".strip(), str(path), track, path in training, seconds, fitting_scale(positions)))
    return found


class Targets:
    """Where the tool should have been: the recorded hand as it is retargeted, with the hand's motion between two samples filled in.

    tool_at: gives T_base_tool (4, 4) at a time in s: from there the tool goes on when the hand engages.
    """

    def __init__(self, recorded, scale, tilt, tool_at):
        retargeter = steadyhand.Retargeter(scale=scale, tilt=tilt)
        self.t = np.asarray(recorded.t) - recorded.t[0]
        held = np.asarray(recorded.clutch, bool) & np.asarray(recorded.tracked, bool)
        answers = [retargeter.update(T, time, tool_at(time), bool(on)) for T, time, on in zip(recorded.T_operator_hand, self.t, held)]
        self.T = np.array([T for T, _ in answers])
        self.engaged = np.array([engaged for _, engaged in answers])

    def at(self, times):
        """T_base_tool (k, 4, 4), and whether it was followed (k,)."""
        after = np.clip(np.searchsorted(self.t, times, side="right"), 1, len(self.t) - 1)
        T = self.T[after - 1].copy()
        for axis in range(3):
            T[:, axis, 3] = np.interp(times, self.t, self.T[:, axis, 3])
        return T, self.engaged[after - 1] & self.engaged[after]


def add_arguments(parser):
    """What every bench of hands takes; hands_of() reads it."""
    parser.add_argument("recordings", nargs="*", type=Path, help="instead of those of the package super-hands")
    parser.add_argument("--train", nargs="*", type=Path, default=[], help="of the recordings, those that are not for judging")
    parser.add_argument("--seconds", type=float, default=20.0, help="of each recording")
    parser.add_argument("--part", choices=("judged", "training", "all"), default="judged")


def hands_of(arguments):
    found = find_hands(arguments.recordings, arguments.train, arguments.seconds)
    return [hand for hand in found if arguments.part in ("all", "training" if hand.training else "judged")]
