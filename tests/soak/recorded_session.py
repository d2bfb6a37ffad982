"""A recorded session as arrays, read with the public MCAP reader; nothing here is the program's own code."""

import json
import struct
from pathlib import Path

import numpy as np
from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader

UNREADABLE = (McapError, EOFError, ValueError, struct.error)  # what the reader says of a file that ends too early
TOPICS = ("/joint_command", "/joint_state", "/supervision", "/operator_settings")


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
    """What one run of the program recorded. @param messages by topic: (t, members); @param spans that files cover, s"""

    def __init__(self, messages, metadata, spans):
        self.metadata, self.spans = metadata, spans
        self.commands = Track(messages["/joint_command"], "q", "dq", "ddq")
        self.states = Track(messages["/joint_state"], "q", "dq")
        self.changes = sorted((t, m["from"], m["to"], m["reason"]) for t, m in messages["/supervision"])
        self.profiles = sorted((t, m["profile"]) for t, m in messages["/operator_settings"] if "profile" in m)  # in force from then on
        self.robot = json.loads(metadata["robot"]["json"]) if "robot" in metadata else None

    @staticmethod
    def read(paths):
        """From its files. One that was cut short gives what can be read of it."""
        messages, metadata, spans = {topic: [] for topic in TOPICS}, {}, []
        for path in sorted(map(Path, paths)):
            times = []
            try:
                with open(path, "rb") as file:
                    for topic, t, members in read_messages(file):
                        messages[topic].append((t, members))
                        if topic in ("/joint_command", "/joint_state"):
                            times.append(t)
            except UNREADABLE:
                pass
            try:
                with open(path, "rb") as file:
                    for record in NonSeekingReader(file).iter_metadata():
                        metadata[record.name] = record.metadata
            except UNREADABLE:
                pass  # it comes first; what was read stays
            if times:
                spans.append((min(times), max(times)))
        return RecordedSession(messages, metadata, spans)

    def covers(self, begin, end):
        """Whether it was recorded all the time from begin to end."""
        return any(a <= begin and end <= b for a, b in self.spans)


def read_messages(file):
    for _, channel, message in NonSeekingReader(file, validate_crcs=True).iter_messages(topics=TOPICS, log_time_order=False):
        yield channel.topic, 1e-9 * message.log_time, json.loads(message.data)


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
