#!/usr/bin/env python3
"""What happened around a time of a session that the adversary kept: tests/soak/show.py FOLDER TIME [SPAN]"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from recorded_session import RecordedSession, begin_on_clock  # noqa: E402
from session_log import SessionLog  # noqa: E402


def main():
    folder, at, span = Path(sys.argv[1]), float(sys.argv[2]), float(sys.argv[3]) if len(sys.argv) > 3 else 0.5
    session = RecordedSession.read(p for p in folder.glob("*.mcap") if "-fault-" not in p.name)
    log = SessionLog.load(folder / "log.jsonl")
    begin = begin_on_clock(session.states, log.of("look"))
    lines = [(e["t"] - begin, " ".join(f"{k}={v}" for k, v in e.items() if k not in ("t", "q", "dq", "command") and v is not None))
             for e in log.entries]
    lines += [(t, f"--- {before} -> {after}: {why}") for t, before, after, why in session.changes]
    lines += [(t, f"--- command |dq| {abs(dq).max():.5f}") for t, dq in list(zip(session.commands.t, session.commands.dq))[::25]]
    for t, words in sorted(lines):
        if abs(t - at) <= span:
            print(f"{t:9.4f}  {words}")


if __name__ == "__main__":
    main()
