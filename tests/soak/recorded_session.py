"""A recorded session as arrays, read with the public MCAP reader; nothing here is the program's own code."""

import json
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

TOPICS = ("/joint_command", "/joint_state", "/supervision", "/operator_sample")


class Track:
    """Messages of one kind: times t (N,) in s since the session's begin, and their numbers (N, joints)."""

    def __init__(self, messages, *members):
        messages = sorted({m[0]: m for m in messages}.values(), key=lambda m: m[0])  # files may overlap
        self.t = np.array([t for t, _ in messages])
        for member in members:
            setattr(self, member, np.array([[np.nan if x is None else x for x in m[member]] for _, m in messages], dtype=float))

    def __len__(self):
        return len(self.t)


class RecordedSession:
    """What the files of one run of the program hold. A file that was cut short gives what can be read of it."""

    def __init__(self, paths):
        found = {topic: [] for topic in TOPICS}
        self.metadata, self.spans = {}, []
        for path in sorted(map(Path, paths)):
            times = self._read(path, found)
            if times:
                self.spans.append((min(times), max(times)))
        self.commands = Track(found["/joint_command"], "q", "dq", "ddq")
        self.states = Track(found["/joint_state"], "q", "dq")
        self.changes = sorted((t, m["from"], m["to"], m["reason"]) for t, m in found["/supervision"])
        self.samples = sorted((t, m["clutch"]) for t, m in found["/operator_sample"])
        self.robot = json.loads(self.metadata["robot"]["json"]) if "robot" in self.metadata else None

    def _read(self, path, found):
        times = []
        with open(path, "rb") as file:
            reader = NonSeekingReader(file, validate_crcs=True)
            try:
                for _, channel, message in reader.iter_messages(log_time_order=False):
                    if channel.topic in found:
                        found[channel.topic].append((1e-9 * message.log_time, json.loads(message.data)))
                    if channel.topic == "/joint_state":
                        times.append(1e-9 * message.log_time)
            except (McapError, EOFError, ValueError) as error:
                self.cut_short = f"{path.name}: {error!r}"
        with open(path, "rb") as file:
            try:
                for record in NonSeekingReader(file).iter_metadata():
                    self.metadata[record.name] = record.metadata
            except (McapError, EOFError, ValueError):
                pass  # metadata comes first; what was read stays
        return times

    def covers(self, begin, end):
        """Whether it was recorded all the time from begin to end."""
        return any(a <= begin and end <= b for a, b in self.spans)


def begin_on_clock(states, looks):
    """When, on the machine's monotonic clock, the session's times count from: the program's live states carry that clock
    (`now_s`), and are found again in the recording by where the joints were or, of a recording from the first cycle on, by
    their number. None: they are not, or do not agree."""
    if not len(states):
        return None
    begins = []
    for look in looks:
        if not look["q"] or None in look["q"]:  # before the first cycle
            continue
        near = np.flatnonzero(np.abs(states.q - look["q"]).max(axis=1) < 1.5e-5)  # six digits are sent
        if len(near) and near[-1] - near[0] == len(near) - 1 <= 3:
            begins.append(look["now_s"] - states.t[near[len(near) // 2]])
    if len(begins) < 5:
        begins = [look["now_s"] - states.t[look["cycles"] - 1] for look in looks if 0 < look["cycles"] <= len(states)]
    begin = float(np.median(begins)) if len(begins) >= 5 else np.nan
    return begin if (np.abs(np.array(begins) - begin) < 0.01).mean() > 0.5 else None
