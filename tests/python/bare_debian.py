"""A Debian 12 without anything, and what is installed there: for tests of packages."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from places import ROOT

NEEDED = pytest.mark.skipif(os.geteuid() != 0 or shutil.which("mmdebstrap") is None, reason="needs root, and mmdebstrap of setup/apt-container.txt")


def make_package(kind, folder):
    """What `./steadyhand KIND` makes, by the name of the package; or the wheel that STEADYHAND_WHEEL names."""
    if kind == "wheel" and "STEADYHAND_WHEEL" in os.environ:
        return {"steadyhand": Path(os.environ["STEADYHAND_WHEEL"]).absolute()}
    done = subprocess.run([ROOT / "steadyhand", kind, folder], capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0, done.stderr[-3000:]
    return {re.split("[-_]0", path.name)[0]: path for path in map(Path, done.stdout.split())}


class BareDebian:
    """A root file system in a folder: the smallest Debian, and `packages`."""

    def __init__(self, folder, *packages):
        self.folder = folder
        subprocess.run(["mmdebstrap", "--quiet", "--variant=minbase", "--include=" + ",".join(["ca-certificates", *packages]), "bookworm", folder], check=True)

    def run(self, *command, user="root", timeout=300):
        """The finished process. It has /proc, and no network except its own loopback."""
        enter = 'mount -t proc proc "$0/proc"; mount --rbind /dev "$0/dev"; ip link set lo up 2>/dev/null; exec chroot --userspec="$1" "$0" /usr/bin/env -i HOME=/tmp PATH=/usr/sbin:/usr/bin:/sbin:/bin "${@:2}"'
        spaces = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "--net"]
        return subprocess.run([*spaces, "bash", "-c", enter, self.folder, user, *map(str, command)], capture_output=True, text=True, timeout=timeout)
