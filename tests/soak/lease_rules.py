"""Rules for who may move the arm, and when: what the recording says beside what the adversary did."""

import re

import numpy as np

from session_log import inside, merged

REST_WITHIN = 1.5  # s, after the event that ended following
SLACK = 0.15  # s, that a message may take to the control loop on a machine that is busy
OBEYED = 0.1  # s, for a stop; on top, cycles that did not run
RACE = 0.02  # s: messages on different sockets this close have no known order
CUT_OFF = 0.05  # s, from being cut off to knowing
CYCLE = 0.01  # s: what comes while a cycle waits for its turn counts in it, after its stamp
MOVES = 1e-5  # rad/s, commanded
STOPPED = ("stopping", "fault")
SHORTEST_RECORDING = 2.0  # s
CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]+")  # control characters, except line ends and tabs


def stops(log):
    return [e["t"] for e in log.requests("stop")] + [e["t"] for e in log.of("end") if e["how"] != "killed"]


def lost_cycles(session, begin, end):
    """s in which the control loop did not run, between two times of the session."""
    t = session.states.t
    t = t[(t >= begin - 1.0) & (t <= end + 1.0)]
    dt = np.diff(t)
    slept = np.flatnonzero(dt > 0.004)
    return float(sum(min(t[i + 1], end) - max(t[i], begin) for i in slept if t[i + 1] > begin and t[i] < end))


def moving(session):
    c = session.commands
    return c.t[np.abs(c.dq).max(axis=1) > MOVES]


def dead_man(session, log):
    """Nothing moves that no living hand and no playback moves, or moved until a moment ago."""
    halts = [t + log.begin for t, _, to, _ in session.changes if to in STOPPED] + stops(log)
    spans = log.hands(SLACK) + log.playbacks(SLACK, terminal=True, ends=halts)
    spans = merged([(a - log.begin, b - log.begin + REST_WITHIN) for a, b in spans])
    t = moving(session)
    orphan = t[~inside(t, spans)]
    if len(orphan):
        yield ("no living hand", float(orphan[0]), f"commanded motion without a hand or playback; {len(orphan)} commands until {orphan[-1]:.2f} s")


def rest_after_disengagement(session, log):
    """From each end of following the arm is at rest within 1.5 s, unless it follows again."""
    changes = session.changes
    t = moving(session)
    for i, (at, before, after, why) in enumerate(changes):
        if before not in ("engaged", "holding") or after in ("engaged", "holding"):
            continue
        again = next((c[0] for c in changes[i + 1:] if c[2] in ("engaged", "idle")), np.inf)
        limit = at + REST_WITHIN + lost_cycles(session, at, at + REST_WITHIN)
        late = t[(t > limit) & (t < again)]
        if len(late):
            yield ("rest", float(at), f"still commanded to move {late[-1] - at:.2f} s after '{why}'")


def was_cut_off(log, stop):
    """Who attacks is cut off, and learns of it a little later: what it wrote meanwhile nobody read."""
    return stop["client"].startswith("attacker") and any(
        e["client"] == stop["client"] and 0.0 <= e["t"] - stop["t"] < CUT_OFF for e in log.of("gone"))


def stop_is_obeyed(session, log):
    """Whoever asks: stopping at once, at rest in time, and until a reset that came later."""
    commands = moving(session)
    resets = lawful_resets(log)
    for e in log.requests("stop"):
        if was_cut_off(log, e):
            continue
        at, heard = e["t"] - log.begin, log.arrival(e["t"]) - log.begin
        within = OBEYED + lost_cycles(session, at, heard + OBEYED)
        if not session.covers(at, heard + within + REST_WITHIN):
            continue
        later = [t - log.begin for t, client in resets if t > e["t"] - race(log, e, t, client)]
        until = min(later, default=np.inf)
        state = state_at(session.changes, heard + within)
        if state not in STOPPED and until > heard + within:
            yield ("stop obeyed", at, f"{e['client']} asked for a stop; {within:.3f} s later the arm is {state}")
            continue
        limit = heard + within + REST_WITHIN + lost_cycles(session, at, heard + within + REST_WITHIN)
        late = commands[(commands > limit) & (commands < until)]
        if len(late):
            yield ("stop obeyed", at, f"still commanded to move {late[-1] - at:.2f} s after a stop of {e['client']}")


def lawful_resets(log):
    """(time, client) of those that came from who may have held the lease."""
    tenures = log.tenures()
    return [(e["t"], e["client"]) for e in log.requests("reset")
            if any(c == e["client"] and a <= e["t"] <= b for c, a, b in tenures)]


def race(log, stop, t, client):
    """s, by which a reset at t may have been sent before the stop and heard after it."""
    return 0.0 if client == stop["client"] else RACE + log.stopped_for(t, stop["t"])


def state_at(changes, t):
    """Of supervision, at a time of the session."""
    state = "idle"
    for change in changes:
        if change[0] > t:
            break
        state = change[2]
    return state


def stop_is_never_undone(session, log):
    """The arm leaves stopping by a reset of who held the lease, sent after the last stop."""
    resets = lawful_resets(log)
    since = -np.inf
    for at, before, after, _ in session.changes:
        now = at + log.begin
        if after in STOPPED and before not in STOPPED:
            since = now - SLACK - log.stopped_for(now - SLACK, now)
        if before not in STOPPED or after in STOPPED:
            continue
        heard = [e for e in log.requests("stop") if log.arrival(e["t"]) + RACE < now]
        good = [t for t, client in resets if since < t < now + CYCLE and
                (not heard or t > heard[-1]["t"] - race(log, heard[-1], t, client))]
        if not good:
            yield ("stop undone", at, f"left {before} for {after} without a reset after the last stop")


def fresh_grip(session, log):
    """Following begins, but after holding, with a clutch that was closed after whatever ended it before."""
    closings = []  # from clients that may have held the lease; a playback's are its own
    clutch = {}
    for e in log.of("sample", "gone"):
        closed = e["kind"] == "sample" and e["clutch"]
        if closed and not clutch.get(e["client"], False):
            closings.append(e["t"])
        clutch[e["client"]] = closed
    closings = np.array(closings)
    halts = [t + log.begin for t, _, to, _ in session.changes if to in STOPPED] + stops(log)
    plays = log.playbacks(SLACK, terminal=True, ends=halts)
    ended = -np.inf
    for at, before, after, why in session.changes:
        now = at + log.begin
        if before in ("engaged", "holding") and after not in ("engaged", "holding"):
            ended = now
        if after != "engaged" or before == "holding" or inside(np.array([now]), plays)[0]:
            continue
        slack = SLACK + log.stopped_for(ended - SLACK, now)
        if not len(closings) or not ((closings > ended - slack) & (closings <= now + CYCLE)).any():
            yield ("fresh grip", at, f"'{why}' without a clutch that was closed since {ended - log.begin:.2f} s")


RULES = (dead_man, rest_after_disengagement, stop_is_obeyed, stop_is_never_undone, fresh_grip)


def program_rules(session, log, found):
    """The program ends when told, in order, and its summary does not say less than was found."""
    for e in log.of("failed"):
        yield ("served", e["t"] - (log.begin or log.entries[0]["t"]), e["what"])
    for e in log.of("end"):
        at = e["t"] - (log.begin or log.entries[0]["t"])
        if e["code"] is None:
            yield ("ends", at, f"was still there {e['took']:.0f} s after it was {e['how']}")
        elif e["how"] != "killed" and e["code"] != 0 and not (e["code"] == 2 and e.get("unread")):
            yield ("ends", at, f"exit code {e['code']} after it was {e['how']}: {e['said'][-300:]}")
        if CONTROL.search(e["said"]):
            yield ("terminal", at, f"printed control characters: {CONTROL.search(e['said'])[0]!r}")
        said = re.search(r"(\d+) looked at, (\d+) beyond a limit, (\d+) in contact", e["said"])
        if not said:
            if e["how"] == "told" and not e.get("deaf"):
                yield ("summary", at, "none was printed")
            continue
        kinds = {rule.split()[-1] for rule, _, _ in found}
        if int(said.group(2)) == 0 and kinds & {"position", "speed", "acceleration", "step"}:
            yield ("summary", at, "says 0 beyond a limit")
        if int(said.group(3)) == 0 and "bodies" in kinds:
            yield ("summary", at, "says 0 in contact")
    if not log.of("end"):
        yield ("ends", 0.0, "the log has no end")


def recording_rules(log):
    """Only paired clients read recordings, none is lost, and requests to record make a bounded number."""
    begin = log.begin or log.entries[0]["t"]
    for e in log.of("spied"):
        if 200 <= e["status"] < 400:
            yield ("unpaired reader", e["t"] - begin, f"got {e['path']} ({e['size']} bytes, status {e['status']}) by '{e['shows']}'")
    for e in log.of("archive"):
        at = e["t"] - begin
        for content, label in e["before"].items():
            labels = [a[1] for a in e["after"] if a[0] == content]
            if len(labels) != 1:
                yield ("recordings", at, f"'{content}' is there {len(labels)} times")
            elif labels[0] != label and not e["killed"]:  # a killed program may be between the two files
                yield ("recordings", at, f"'{content}' has the label '{labels[0]}' in place of '{label}'")
        most = (e["t"] - log.entries[0]["t"]) / SHORTEST_RECORDING + 2
        if e["recordings"] > most:
            yield ("recordings", at, f"the session made {e['recordings']} recordings, more than {most:.0f}")
