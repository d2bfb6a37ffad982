#!/usr/bin/env python3
"""Judges a session by its recording and by what was done to it, without any of the program's own code.

    tests/soak/judge.py LOG.jsonl SESSION.mcap...

Each rule is a function of this file or of motion_rules.py and yields violations. Exit code 1: there are some."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import lease_rules  # noqa: E402
import motion_rules  # noqa: E402
from recorded_session import RecordedSession, begin_on_clock  # noqa: E402
from session_log import SessionLog  # noqa: E402


def judge(session, log):
    """Every violation as (rule, time in the session, words)."""
    found = []
    if session.robot is not None and len(session.commands):
        for rule in motion_rules.RULES:
            found += rule(session)
        found += motion_rules.profile_limits(session, log)
    log.begin = begin_on_clock(session.states, log.of("look"))
    if log.begin is not None:
        for rule in lease_rules.RULES:
            found += rule(session, log)
    found += lease_rules.program_rules(session, log, found)
    found += lease_rules.recording_rules(log)
    return sorted(found, key=lambda v: v[1])


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    log = SessionLog.load(sys.argv[1])
    session = RecordedSession.read(sys.argv[2:])
    violations = judge(session, log)
    for rule, t, words in violations:
        print(f"{t:9.3f} s  {rule}: {words}")
    print(f"{len(session.commands)} commands, {len(session.states)} states, {len(violations)} violations")
    return 1 if violations else 0


if __name__ == "__main__":
    sys.exit(main())
