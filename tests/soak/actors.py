"""Those who meet a session: operators, watchers, attackers, and who tampers with the program. Each is a generator that does
one thing after the other and yields how long it waits before the next, in s."""

import json
import re
import socket
import time

import hands
from network import frame

REQUESTS = ("stop", "reset")
PROFILES = ("tracking", "anti-slosh", "waiter", "carry", "follow")
RECORDINGS = ("carrying", "events-demo-recording", "mouse-demo-recording", "physics-demo-laser")
SERVED_WITHIN = CUT_OFF_WITHIN = 5.0  # s
FLOOD = 20000  # messages: eight times what is too much
PARTS = ("session.mcap", "motion", "report.html")  # parts of a recording, as /sessions/NAME/PART


def samples(client, hand, seconds, clutch, rate, **members):
    """The hand on its way, `rate` times a second."""
    begin, tick = time.monotonic(), 0
    while (t := time.monotonic() - begin) < seconds and not client.gone:
        p, q = hand(t)
        client.sample(p, clutch, **({"q": list(q)} | members))
        tick += 1
        yield max(0.0, begin + tick / rate - time.monotonic())


def request(client, kind, **members):
    client.send(type="request", kind=kind, **members)


def bursts(world, random, clients):
    """Stops and resets in some order, from one or several, at once or some ms apart."""
    for _ in range(random.randint(1, 5)):
        request(random.choice(clients), random.choice(REQUESTS))
        if random.random() < 0.5:
            yield random.choice((0.001, 0.002, 0.01, 0.1, 0.4))


def change_a_setting(world, random, client):
    kind = random.choice(("profile", "profile", "weight", "weight", "scale", "yaw", "rate", "record", "object", "object", "fill", "refused"))
    if kind == "profile":
        request(client, kind, text=random.choice(world.profiles))
    elif kind == "weight":
        terms = ("position", "orientation", "velocity", "acceleration", "lateral", "vertical")
        request(client, kind, text=random.choice(terms), value=random.choice((0.0, 0.01, 1.0, 100.0, 1e6)))
    elif kind == "scale":
        request(client, kind, value=random.choice((0.01, 0.5, 1.0, 2.0, 10.0)))
    elif kind == "yaw":
        request(client, kind, value=random.uniform(-3.2, 3.2))
    elif kind == "rate":
        request(client, kind, value=random.choice((20.0, 50.0, 100.0, 250.0, 500.0)))
    elif kind == "record" and world.may_stop_recording:
        request(client, kind, value=random.choice((0, 1, 1)))
    elif kind == "fill":
        request(client, kind, value=random.uniform(0.03, 0.09))
    elif kind == "object":
        request(client, kind, text=f"object {random.randrange(4)}", object=some_object(random))
    else:
        request(client, "rate", value=1e5)  # refused, on the terminal


def some_object(random):
    """Something solid somewhere around the arm, or in it, that may fly; half of the time it goes away."""
    if random.random() < 0.5:
        return None
    sizes = random.choice(({"shape": "sphere", "radius": 0.1}, {"shape": "box", "size": [0.3, 0.2, 0.1]}, {"shape": "capsule", "radius": 0.05, "length": 0.4}))
    place = [random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0, 1)]
    flight = [random.choice((0, 0, random.uniform(-1, 1))) for _ in range(3)]
    return sizes | {"p": place, "q": [0, 0, 0, 1], "velocity": flight, "margin": random.choice((0, 0.01, 0.1))}


def operator(world, random):
    """Connects, takes the lease, drives with real and impossible hands, loses what can be lost, and comes back."""
    token = None
    while True:
        client = world.connect("operator", random, token=token, pair=token is None)
        if client is None:
            yield 1.0
            continue
        yield random.choice((0.1, 0.3, 3.0))
        token = client.token or token
        if random.random() < 0.2:  # lets a recording lead, and looks on or goes
            client.send(type="take")
            yield 0.2
            request(client, "playback", text=random.choice(RECORDINGS))
            yield random.uniform(0.5, 6.0)
            if random.random() < 0.5:
                client.leave()
                yield random.uniform(1.0, 8.0)
                continue
        stays = time.monotonic() + random.uniform(4.0, 25.0)
        while not client.gone and time.monotonic() < stays:
            if not client.holds:
                client.send(type=random.choice(("take", "take", "ask")))
                yield 0.2
                if not client.holds:
                    yield random.uniform(0.2, 2.0)
                    if random.random() < 0.3:
                        yield from samples(client, hands.swing(random), 0.5, True, 90.0)  # without the lease
                    continue
            yield from drive(world, random, client)
        yield from farewell(random, client)


def drive(world, random, client):
    """A grip from its beginning to its end."""
    network = client.network
    network.loss, network.reorder = random.choice((0, 0, 0, 0.1, 0.3)), random.choice((0, 0, 0, 0.1))
    hand, rate = random.choice(hands.KINDS)(random), random.choice((60.0, 90.0, 90.0, 200.0))
    yield from samples(client, hand, random.choice((0.1, 0.3)), False, rate)
    grip = samples(client, hand, random.uniform(0.5, 6.0), True, rate)
    for pause in grip:
        yield pause
        if random.random() < 1.0 / rate:  # about once a second
            yield from interlude(world, random, client, hand, rate)
    end = random.random()
    if end < 0.5:
        network.loss = 0.0
        yield from samples(client, hand, random.choice((0.05, 0.5, 2.0)), False, rate)
    elif end < 0.8:
        yield random.choice((0.1, 0.26, 1.0, 3.5))  # a pause; at last the lease ends


def interlude(world, random, client, hand, rate):
    """Something else while the clutch is closed."""
    kind = random.choice(("stop", "bursts", "setting", "setting", "refill", "stall", "clock", "untracked", "emulated", "playback", "reset",
                          "give", "silence", "take", "answer"))
    world.count(kind)
    if kind in REQUESTS:
        request(client, kind)
        yield random.choice((0.0, 0.05, 0.8))
        if random.random() < 0.7:
            request(client, "reset")
    elif kind == "bursts":
        yield from bursts(world, random, [client] + world.others(client))
        yield 0.5
        request(client, "reset")
    elif kind == "setting":
        change_a_setting(world, random, client)
    elif kind == "refill":
        for _ in range(random.choice((1, 1, 5))):
            request(client, kind)
    elif kind == "stall":
        client.network.stall_until = time.monotonic() + random.choice((0.03, 0.08, 0.08, 0.2, 0.4))
    elif kind == "clock":
        client.network.clock += random.choice((-5.0, -0.3, -0.05, 0.05, 0.3, 5.0))
    elif kind in ("untracked", "emulated"):
        members = {"tracked": False} if kind == "untracked" else {"emulated": True}
        yield from samples(client, hand, random.choice((0.02, 0.15, 0.4)), True, rate, **members)
    elif kind == "playback":
        request(client, "playback", text=random.choice(RECORDINGS))
        yield random.uniform(0.5, 8.0)
        yield from random.choice((lambda: bursts(world, random, [client] + world.others(client)), lambda: farewell(random, client),
                                  lambda: iter([request(client, "playback", text="") or 0.0]), lambda: iter([0.0])))()
    elif kind == "give":
        client.send(type="release")
        yield random.choice((0.0, 0.3))
    elif kind == "silence":
        yield random.choice((0.05, 0.11, 0.3, 1.0))
    elif kind == "take":
        client.send(type="take")
    elif kind == "answer":  # to who may have asked for the lease
        client.send(type="answer", grant=random.random() < 0.5)


def farewell(random, client):
    """Goes in one of several ways; at last its connection is closed."""
    way = random.choice(("close", "give", "deaf", "half"))
    if way == "give":
        client.send(type="release")
        yield random.choice((0.0, 0.5))
    elif way == "deaf":  # says and hears nothing more, but its connection stays
        client.deaf = True
        yield random.choice((0.5, 4.0))
    elif way == "half":  # in the middle of a message
        client.raw(frame(b'{"type":"sample","seq')[:-3])
        yield 0.2
    client.leave()
    yield random.choice((0.0, 0.3, 2.0))


def watcher(world, random):
    """Sees everything, says nothing but pings and, seldom, stop."""
    while True:
        client = world.connect("watcher", random, looks=True)
        if client is None:
            yield 1.0
            continue
        stays = time.monotonic() + random.uniform(10.0, 60.0)
        while not client.gone and time.monotonic() < stays:
            client.ping()
            yield 0.5
            if random.random() < 0.02:
                world.count("watcher's stop")
                request(client, "stop")
        client.leave()


def helper(world, random):
    """The person who resets after others' stops, and never moves anything. Without the lease that is refused."""
    while True:
        yield random.uniform(1.0, 4.0)
        for client in world.holders():
            request(client, "reset")


def brawler(world, random):
    """Everybody presses stop and reset, in all orders, in motion and at rest."""
    while True:
        yield random.choice((0.3, 1.0, 3.0, 8.0))
        clients = [c for c in world.clients if not c.gone and not c.deaf and c.role in ("operator", "watcher")]
        if clients:
            world.count("bursts")
            yield from bursts(world, random, clients)


def attacker(world, random):
    """Wants to command without a right to, and to keep others from it."""
    ways = (garbage, stranger, guesser, crowd, deaf_one, flooder, pinger, pieces)
    while True:
        yield random.uniform(0.5, 5.0)
        way = random.choice(ways)
        world.count(way.__name__)
        yield from way(world, random)


def garbage(world, random):
    client = world.connect("attacker", random)
    if client is None:
        return
    seeds = [b'{"type":"sample","sequence":1,"t_s":1e308,"p":[0,0,1],"q":[0,0,0,1],"clutch":true,"tracked":true,"emulated":false}',
             b'{"type":"request","kind":"weight","text":"lateral","value":-1}', b"[" * 900, b"\xff\xfe", b"", b"null", b'{"type":{}}']
    for _ in range(random.randint(3, 40)):
        text = bytearray(random.choice(seeds))
        for _ in range(random.randint(0, 3)):
            if text:
                text[random.randrange(len(text))] = random.randrange(256)
        client.raw(frame(bytes(text), opcode=random.choice((1, 1, 1, 2, 3, 9, 15)), final=random.random() < 0.9))
        yield 0.01
    client.leave()


def stranger(world, random):
    """Samples and requests without code and lease."""
    client = world.connect("attacker", random)
    if client is None:
        return
    client.send(type="take")
    yield from samples(client, hands.swing(random), random.uniform(0.5, 3.0), True, 200.0)
    request(client, "reset")
    client.send(type="request", kind="playback", text="carrying")
    yield 0.2
    client.leave()


def guesser(world, random):
    client = world.connect("attacker", random)
    if client is None:
        return
    for _ in range(random.randint(1, 8)):
        client.send(type="pair", code="".join(random.choice("abcdefghjkmnpqrstuvwxyz23456789") for _ in range(10)))
        yield 0.05
    client.leave()


def crowd(world, random):
    """Many who stay and say little."""
    many = [world.connect("attacker", random) for _ in range(random.choice((5, 40, 110)))]
    many = [client for client in many if client is not None]
    end = time.monotonic() + random.uniform(1.0, 6.0)
    while time.monotonic() < end:
        for client in many:
            client.ping()
        yield 1.0
    for client in many:
        client.leave()


def deaf_one(world, random):
    """Asks for much and reads nothing."""
    client = world.connect("attacker", random)
    if client is None:
        return
    client.deaf = True
    for _ in range(random.randint(100, 2000)):
        client.ping()
        if client.gone:
            break
        yield 0.005
    client.leave()


def flooder(world, random):
    yield from flood(world, random, frame(b'{"type":"ping","t_s":1}'))


def pinger(world, random):
    """Control frames and empty continuations."""
    kinds = (frame(b"x" * 125, opcode=9), frame(b"x", opcode=10), frame(b"", opcode=0, final=False))
    yield from flood(world, random, random.choice(kinds))


def flood(world, random, one):
    """As fast as the program takes it: who does that is cut off."""
    client = world.connect("attacker", random)
    if client is None:
        return
    many, written = 200 * one, 0
    end = time.monotonic() + random.choice((0.5, 1.0, CUT_OFF_WITHIN))
    while time.monotonic() < end and not client.gone:
        if not client.unsent:
            client.raw(many)
            written += 200
        yield 0.002
    if not client.gone and written > FLOOD:
        world.log("failed", what=f"who sent {written} messages in {CUT_OFF_WITHIN:.0f} s was not cut off")
    client.leave()


def pieces(world, random):
    """A message in single bytes, slowly; then a length that never comes."""
    client = world.connect("attacker", random)
    if client is None:
        return
    for byte in frame(json.dumps({"type": "ping", "t_s": 1.0}).encode()):
        client.raw(bytes([byte]))
        yield 0.005
    client.raw(b"\x81\xff" + b"\x7f" * 8)
    yield 0.5
    client.leave()


def saboteur(world, random):
    """Stops the program for a moment, and takes its terminal away."""
    while True:
        yield random.uniform(1.0, 8.0)
        if random.random() < 0.85:
            world.count("pause")
            world.program.pause(random.choice((0.005, 0.01, 0.02, 0.03, 0.05, 0.07, 0.09, 0.12, 0.2, 0.3)))
        elif world.may_block_output:
            world.count("blocked stdout")
            world.program.deaf = True
            for client in world.holders():
                for _ in range(80):  # refusals are printed on the terminal: the pipe is full
                    request(client, "rate", value=1e5)
            yield random.uniform(2.0, 10.0)
            world.program.deaf = False


def stumbler(world, random):
    """Stops the program for a moment, again and again, under the profile that spills nothing."""
    while True:
        yield random.uniform(0.2, 2.0)
        if world.profile == "carry" and world.holders():
            world.count("stumbles")
            world.program.pause(random.choice((0.005, 0.01, 0.015, 0.02, 0.03, 0.05, 0.07, 0.1)))


def archivist(world, random):
    """Renames recordings in a hurry: two to one name at once, to a name that the program may be about to give, or that is taken."""
    while True:
        yield random.uniform(0.3, 3.0)
        holders, names = world.holders(), sorted(world.archived())
        if not holders or len(names) < 2:
            continue
        one, two = random.sample(names, 2)
        running = world.running_recording()
        to = random.choice((f"kept-{random.randrange(4)}", f"kept-{random.randrange(4)}", f"{running}_{random.randint(2, 3)}", two, running))
        if random.random() < 0.1:
            to += "\x1b]0;renamed\x07"  # would be the title of the terminal's window
        world.count("renames", by=2)
        clients = [random.choice(holders) for _ in range(2)]
        for client, name in zip(clients, (one, two)):
            request(client, "rename", text=name, to=to)


def newcomer(world, random):
    """A person who comes to stop the arm: is served, and the stop is obeyed, whatever else goes on."""
    while True:
        yield random.uniform(5.0, 20.0)
        begin = time.monotonic()
        client = None
        while client is None and time.monotonic() < begin + SERVED_WITHIN:
            client = world.connect("newcomer", random)
            yield 0.1
        while client is not None and client.number is None and time.monotonic() < begin + SERVED_WITHIN:
            yield 0.02
        if client is None or client.number is None:
            world.log("failed", what=f"a newcomer was not served within {SERVED_WITHIN:.0f} s")
        elif random.random() < 0.3:
            world.count("newcomer's stop")
            request(client, "stop")
            yield 0.3
        if client is not None:
            client.leave()


def reader(world, random):
    """Reads recorded sessions, which takes the program's time and memory; without a token it gets nothing."""
    while True:
        yield random.uniform(2.0, 15.0)
        token = next((client.token for client in world.clients if client.token and not client.gone), None)
        if token is None:
            continue
        world.count("reports read")
        status, listed = yield from fetch(world, "/sessions", f"Authorization: Bearer {token}")
        if status in (401, 403):
            world.log("failed", what=f"a paired reader's list of recordings was answered {status}")
        names = re.findall(rb'"name":"([^"]+)"', listed)
        if names:
            yield from fetch(world, f"/sessions/{random.choice(names).decode()}/{random.choice(PARTS)}", f"Authorization: Bearer {token}")


def spy(world, random):
    """Downloads recordings without having paired. They show people, as cameras do."""
    while True:
        yield random.uniform(1.0, 8.0)
        names = sorted(path.stem for path in world.folder.glob("*.mcap"))
        path = f"/sessions/{random.choice(names)}/{random.choice(PARTS)}" if names and random.random() < 0.8 else "/sessions"
        made_up = "".join(random.choice("abcdefghjkmnpqrstuvwxyz23456789") for _ in range(26))
        shows = random.choice(("Accept: */*", f"Authorization: Bearer {made_up}", "Authorization: Bearer ", f"Cookie: steadyhand-{world.program.port}={made_up}"))
        world.count("recordings spied on")
        status, answer = yield from fetch(world, path, shows)
        world.log("spied", path=path, shows=shows, status=status, size=len(answer))


def fetch(world, path, header, seconds=10.0):
    """(status, everything that came in time) of a GET; status 0: nothing came."""
    answer, end = b"", time.monotonic() + seconds
    try:
        connection = socket.create_connection(("127.0.0.1", world.program.port), timeout=1.0)
        connection.setblocking(False)
        connection.send(f"GET {path} HTTP/1.1\r\nHost: localhost:{world.program.port}\r\n{header}\r\nConnection: close\r\n\r\n".encode())
    except OSError:
        return 0, answer
    with connection:
        while time.monotonic() < end:
            try:
                more = connection.recv(1 << 20)
                if not more:
                    break
                answer += more
            except BlockingIOError:
                yield 0.02
            except OSError:
                break
    status = re.match(rb"HTTP/1\.1 (\d{3}) ", answer)
    return int(status[1]) if status else 0, answer
