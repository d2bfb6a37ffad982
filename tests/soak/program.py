"""The program under attack: started on a free port, its output read or left alone, stopped, told to end."""

import fcntl
import os
import re
import resource
import signal
import subprocess
import time

from live_client import PROGRAM

F_SETPIPE_SIZE = 1031
END_WITHIN = 20.0  # s


class Program:
    def __init__(self, folder, arguments, log, file_size=None):
        self.log, self.folder = log, folder
        limit = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (file_size, file_size))) if file_size else None
        self.process = subprocess.Popen(
            [PROGRAM, "demo", "--no-browser", "--port", "0", "--sessions", str(folder), *map(str, arguments)],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, preexec_fn=limit)
        self.output = self.process.stdout.fileno()
        fcntl.fcntl(self.output, F_SETPIPE_SIZE, 4096)
        os.set_blocking(self.output, False)
        self.said, self.codes, self.deaf, self.port = "", [], False, None
        self.unread = False  # no one reads for a while: it may drop output, and says so by its exit code
        deadline = time.monotonic() + 60.0
        while self.port is None:
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"did not start: {self.said}")
            time.sleep(0.02)
            self.listen()

    def listen(self):
        """Reads what it printed, unless nobody is to read it now."""
        if self.deaf:
            self.unread = True
            return
        try:
            while more := os.read(self.output, 65536):
                self.said += more.decode(errors="replace")
        except BlockingIOError:
            pass
        found = re.findall(r"^open +http://[^:]+:(\d+)/#(?:\w+=)?(\w+)\s*$", self.said, re.MULTILINE)
        if found:
            self.port = int(found[0][0])
            self.codes = [code for _, code in found]

    def pause(self, seconds):
        begin = time.monotonic()
        self.process.send_signal(signal.SIGSTOP)
        try:
            time.sleep(seconds)
        finally:
            self.process.send_signal(signal.SIGCONT)
        self.log("pause", t=begin, until=time.monotonic())

    def memory_mib(self):
        try:
            with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as file:
                return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
        except (OSError, IndexError):
            return 0.0

    def died(self):
        return self.process.poll() is not None

    def end(self, how):
        """Tells it to end, in one of several ways; nobody has to read what it says for that."""
        begin = time.monotonic()
        died = self.died()
        if not died:
            self.process.send_signal({"killed": signal.SIGKILL, "terminated": signal.SIGTERM}.get(how, signal.SIGINT))
            if how == "told twice":
                time.sleep(0.05)
                if not self.died():
                    self.process.send_signal(signal.SIGINT)
        deadline = begin + END_WITHIN
        while not self.died() and time.monotonic() < deadline:
            time.sleep(0.02)
            self.listen()
        code = self.process.poll()
        deaf, self.deaf = self.deaf, False
        if code is None:
            self.process.kill()
            self.process.wait()
        self.listen()
        self.log("end", t=begin, how="gone before it was told" if died else how, code=code,
                 took=time.monotonic() - begin, said=self.said, unread=self.unread, deaf=deaf)
        self.process.stdout.close()
