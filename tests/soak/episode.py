"""One session of the adversary: the program, everybody who meets it, and the log of it."""

import json
import random as random_module
import select
import time
from collections import Counter

import actors
from hands import ROOT
from network import FaultyClient
from program import Program

CAST = {"operator": (actors.operator, (1, 1, 2)), "watcher": (actors.watcher, (1, 2)), "helper": (actors.helper, (1,)),
        "newcomer": (actors.newcomer, (1,)), "attacker": (actors.attacker, (0, 0, 1, 2)), "saboteur": (actors.saboteur, (0, 1, 1)),
        "brawler": (actors.brawler, (0, 1, 1)), "reader": (actors.reader, (0, 0, 1)), "spy": (actors.spy, (0, 1, 1)),
        "stumbler": (actors.stumbler, (1,)), "archivist": (actors.archivist, (1,))}
MEMORY = 250.0  # MiB, at most
GENTLE = {"gentle": 0.3}  # velocity_scale of a profile that is none of the bundled ones
MAGIC = b"\x89MCAP0\r\n"
ENDS = ("told", "told", "told twice", "terminated", "killed")


class World:
    """What the actors share."""

    def __init__(self, folder, seed):
        self.folder, self.entries, self.counts, self.clients = folder, [], Counter(), []
        self.random = random_module.Random(f"episode {seed}")
        self.seed, self.number, self.most_memory = seed, 0, 0.0
        full = self.random.random() < 0.1
        self.may_stop_recording = self.random.random() < 0.2
        self.may_block_output = self.random.random() < 0.3
        self.profiles, self.profile = list(actors.PROFILES), self.random.choice((*actors.PROFILES, "carry", "gentle"))
        arguments = self.choose_arguments()
        self.archive = {f"archive {i}": "" if i % 2 else f"label of archive {i}" for i in range(6)}
        self.fill_archive()
        if full:
            self.count("full disk")
        self.log("start", seed=seed, arguments=arguments, full=full, velocity_scales=GENTLE)
        self.program = Program(folder, arguments, self.log, file_size=self.random.randint(200, 3000) * 1000 if full else None)

    def choose_arguments(self):
        choose = self.random.choice
        profile = self.gentle_profile() if self.profile == "gentle" else self.profile
        arguments = ["--profile", profile, "--scale", choose((0.5, 1.0, 2.0)), "--yaw", choose((0, 90, 180))]
        if self.random.random() < 0.4:
            arguments += ["--rate", choose((20, 50, 100, 250, 500))]
        if self.random.random() < 0.2:
            arguments += ["--set", f"control.soft_stop={choose((0, 0.1, 1.0))}"]
        return arguments

    def gentle_profile(self):
        """A file: tracking, but slower."""
        text = (ROOT / "profiles/tracking.yaml").read_text()
        scaled = text.replace("name: tracking", "name: gentle").replace("velocity_scale: 1.0", f"velocity_scale: {GENTLE['gentle']}")
        assert scaled.count("gentle") and scaled.count(f"velocity_scale: {GENTLE['gentle']}") == 1
        path = self.folder / "gentle.yaml"
        path.write_text(scaled)
        self.profiles += ["gentle", "gentle"]
        return str(path)

    def fill_archive(self):
        """Recordings that were there before, each with its own content, some with a label."""
        for content, label in self.archive.items():
            path = self.folder / f"{content.replace(' ', '-')}.mcap"
            path.write_text(content)
            if label:
                path.with_suffix(".label").write_text(label + "\n")

    def archived(self):
        """name: (content, label) of those, as they are called now."""
        found = {}
        for path in self.folder.glob("*.mcap"):
            try:
                with open(path, "rb") as file:
                    content = file.read(100)
                label = path.with_suffix(".label")
                if not content.startswith(MAGIC):
                    found[path.stem] = content.decode(errors="replace"), label.read_text().strip() if label.exists() else ""
            except OSError:
                continue  # it was renamed in this moment
        return found

    def running_recording(self):
        """Name of the newest recording of this session."""
        return max((p.stem for p in self.folder.glob("2*.mcap") if "-fault-" not in p.name), default="none")

    def log(self, kind, t=None, **members):
        self.entries.append({"t": time.monotonic() if t is None else t, "kind": kind, **members})

    def count(self, what, by=1):
        self.counts[what] += by

    def connect(self, role, random, token=None, pair=False, looks=False):
        """A client, or None if the server has no room."""
        self.number += 1
        self.count(f"{role}s")
        name = f"{role} {self.number}"
        client = None
        try:
            client = FaultyClient(self.program.port, self.log, name, random, token)
        except (OSError, AssertionError, ConnectionError):
            self.count("turned away")
            return None
        client.looks, client.role = looks, role
        self.clients.append(client)
        if pair and not self.program.deaf:
            self.program.listen()
            client.send(type="pair", code=self.program.codes[-1])
        return client

    def holders(self):
        return [c for c in self.clients if c.holds and not c.gone]

    def others(self, client):
        return [c for c in self.clients if c is not client and not c.gone and not c.deaf][:4]

    def hear(self):
        """Everybody takes what came and writes what is due."""
        for client in self.clients:
            for message in client.listen():
                if message["type"] == "state" and client.looks:
                    self.log("look", now_s=message["now_s"], state=message["state"], q=message["q"], dq=message["dq"],
                             command=message["command"],
                             cycles=message["cycles"])
            client.flush()
        self.clients = [c for c in self.clients if not c.gone]
        self.program.listen()

    def play(self, seconds):
        """Lets everybody act for so long, then ends the program; how."""
        queue = []
        for name, (act, numbers) in CAST.items():
            for i in range(self.random.choice(numbers)):
                queue.append([time.monotonic(), act(self, random_module.Random(f"{self.seed} {name} {i}"))])
        end = time.monotonic() + seconds
        looked = 0.0
        while (now := time.monotonic()) < end and not self.program.died():
            for entry in sorted(queue, key=lambda e: e[0]):
                if entry[0] <= now:
                    entry[0] = time.monotonic() + max(0.0, next(entry[1]))
            self.hear()
            if now - looked > 1.0:
                looked = now
                self.most_memory = max(self.most_memory, self.program.memory_mib())
                if self.most_memory > MEMORY and not self.counts["too much memory"]:
                    self.count("too much memory")
                    self.log("failed", what=f"the program takes {self.most_memory:.0f} MiB")
            wait = min(entry[0] for entry in queue) - time.monotonic()
            if wait > 0.0:
                sockets = [c.socket for c in self.clients if not c.gone and not c.deaf]
                select.select(sockets, [], [], min(wait, 0.01))
        how = self.random.choice(ENDS)
        self.count(f"end: {how}")
        self.program.end(how)
        for client in self.clients:
            client.leave()
        recordings = [p for p in self.folder.glob("*.mcap") if "-fault-" not in p.name and p.stem not in self.archived()]
        self.log("archive", before=self.archive, after=list(self.archived().values()), killed=how == "killed", recordings=len(recordings))
        return how

    def save(self, path):
        with open(path, "w", encoding="utf-8") as file:
            for entry in self.entries:
                file.write(json.dumps(entry) + "\n")
