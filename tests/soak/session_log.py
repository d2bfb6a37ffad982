"""What the adversary did and saw, as it wrote it down: a JSON object a line, `t` on the machine's monotonic clock.

| kind | members |
|---|---|
| sample | client, clutch: written to its socket at t |
| request | client, request, text, value |
| take, give, gone | client, paired: takes or asks for the lease, gives it back, closed its connection or was cut off |
| lease | client: was told that it holds the lease; holder: number of who does, as anybody was told |
| pause | until: the program was stopped (SIGSTOP) from t on |
| look | now_s, state, q, dq, command, command_dq: a live state as a watcher got it |
| spied | path, shows (header), status, size: a client that had not paired asked for a recording |
| archive | before (label by content), after (list of content and label): recordings that were there before the session, at its end; recordings: how many files the session made |
| end | how; code: the program's exit code; took: s; said: its output |
| failed | what: a promise to a client that was not kept |
"""

import json

import numpy as np

HEARD = 0.25  # s, that the word of a hand lasts
TOLD = 0.1  # s, from getting the lease to the report of it


class SessionLog:
    def __init__(self, entries):
        self.entries = sorted(entries, key=lambda e: e["t"])
        self.begin = None  # the session's time, set by the judge
        self.pauses = [(e["t"], e["until"]) for e in self.of("pause")]

    @staticmethod
    def load(path):
        with open(path, encoding="utf-8") as file:
            return SessionLog([json.loads(line) for line in file])

    def of(self, *kinds):
        return [e for e in self.entries if e["kind"] in kinds]

    def requests(self, *names):
        return [e for e in self.of("request") if e["request"] in names]

    def arrival(self, t):
        """When the program can have heard what was written at t."""
        for begin, until in self.pauses:
            if begin <= t < until:
                return until
        return t

    def stopped_for(self, begin, end):
        """s, of SIGSTOP between the two."""
        return sum(max(0.0, min(end, until) - max(begin, a)) for a, until in self.pauses)

    def tenures(self):
        """(client, from, to): when a client may have held the lease. From when it took it or was told to hold it; to when it gave
        it back, was gone, or another was told to hold it."""
        tenures, since = [], {}

        def close(client, t):
            if client in since:
                tenures.append((client, since.pop(client), self.arrival(t)))

        for e in self.entries:
            if e["kind"] == "take" and e["paired"]:
                since.setdefault(e["client"], e["t"])
            elif e["kind"] in ("give", "gone"):
                close(e["client"], e["t"])
            elif e["kind"] == "lease":
                for other in [c for c in since if c != e["client"]]:
                    close(other, e["t"])
                since.setdefault(e["client"], e["t"] - TOLD)  # it asked long ago
        for client in list(since):
            close(client, self.entries[-1]["t"])
        return tenures

    def hands(self, slack):
        """(from, to): spans in which a hand lived: somebody who may have held the lease had sent a closed clutch lately."""
        tenures = self.tenures()
        by_client = {}
        for client, begin, end in tenures:
            by_client.setdefault(client, []).append((begin, end))
        spans = []
        for e in self.of("sample"):
            if e["clutch"] and any(a <= e["t"] <= b for a, b in by_client.get(e["client"], ())):
                heard = self.arrival(e["t"])
                spans.append((e["t"], heard + HEARD + slack + self.stopped_for(heard, heard + HEARD + slack)))
        return merged(spans)

    def playbacks(self, slack, terminal, ends):
        """(from, to): spans in which a recording may have led. It is the lease's of who asked for it, or (`terminal`) the one
        that the program begins with; `ends`: times of stops and faults."""
        tenures = self.tenures()
        spans = []
        stops = sorted(ends)
        for e in self.requests("playback"):
            if not e["text"]:
                continue
            for client, begin, end in tenures:
                if client == e["client"] and begin <= e["t"] <= end:
                    spans.append((e["t"], end))
        if terminal:
            first = min((e["t"] for e in self.of("take")), default=np.inf)
            told = min((e["t"] for e in self.of("lease")), default=np.inf)
            spans.append((self.entries[0]["t"], max(first, told) + slack))
        ended = []
        for begin, end in spans:
            after = [s for s in stops if s > begin]
            ended.append((begin, min(end, self.arrival(after[0]) + slack) if after else end))
        return merged(ended)


def merged(spans):
    """The union, as spans apart from one another."""
    union = []
    for begin, end in sorted(spans):
        if union and begin <= union[-1][1]:
            union[-1] = (union[-1][0], max(union[-1][1], end))
        else:
            union.append((begin, end))
    return union


def inside(t, spans):
    """Which of the times t (N,) lie in one of the spans, which are apart and in order."""
    if not spans:
        return np.zeros(len(t), dtype=bool)
    begins, ends = np.array(spans).T
    i = np.searchsorted(begins, t, side="right") - 1
    return (i >= 0) & (t <= ends[np.clip(i, 0, None)])
