"""A Debian 12 without anything: for tests of what a fresh machine needs. Takes root and mmdebstrap."""

import os
import shutil
import subprocess

import pytest

NEEDED = pytest.mark.skipif(os.geteuid() != 0 or shutil.which("mmdebstrap") is None, reason="takes root and mmdebstrap, of setup/apt-aarch64.txt")


class BareDebian:
    """A root in a folder, with `packages` beside what every Debian has. Commands run in it without network."""

    def __init__(self, folder, *packages):
        self.folder = folder
        subprocess.run(["mmdebstrap", "--quiet", "--variant=minbase", "--include=" + ",".join(["ca-certificates", *packages]), "bookworm", folder], check=True)

    def run(self, *command, user="root", network=False, timeout=300):
        """With /proc, and an own network of the loopback alone; the finished process."""
        enter = 'mount -t proc proc "$0/proc"; mount --rbind /dev "$0/dev"; ip link set lo up 2>/dev/null; exec chroot --userspec="$1" "$0" /usr/bin/env -i HOME=/tmp PATH=/usr/sbin:/usr/bin:/sbin:/bin "${@:2}"'
        spaces = ["unshare", "--mount", "--pid", "--fork", "--kill-child", *([] if network else ["--net"])]
        return subprocess.run([*spaces, "bash", "-c", enter, self.folder, user, *map(str, command)], capture_output=True, text=True, timeout=timeout)
