"""The image of Containerfile: built by buildah on a Debian 12 that mmdebstrap makes, and run as its user."""

import json
import os
import re
import shutil
import subprocess

import pytest

from bare_debian import make_package
from places import ROOT

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(os.geteuid() != 0 or not (shutil.which("buildah") and shutil.which("mmdebstrap")),
                       reason="needs root, and buildah and mmdebstrap of setup/apt-container.txt"),
]  # fmt: skip


def run(*command):
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return make_package("wheel", tmp_path_factory.mktemp("dist"))["steadyhand"]


@pytest.fixture(scope="module")
def buildah(wheel, tmp_path_factory):
    """Runs buildah, whose images are `debian` and `steadyhand`."""
    folder = tmp_path_factory.mktemp("images")
    store = ["--root", folder / "images", "--runroot", folder / "run", "--storage-driver", "vfs"]

    def buildah(*words):
        return run("buildah", *store, *words)

    run("mmdebstrap", "--variant=minbase", "bookworm", folder / "debian.tar")
    base = buildah("from", "scratch").strip()
    buildah("add", base, folder / "debian.tar", "/")
    buildah("commit", "--rm", base, re.search("^FROM (.*)", (ROOT / "Containerfile").read_text(), re.MULTILINE)[1])
    # pip trusts what this machine trusts.
    (folder / "pip.conf").write_text("[global]\ncert = /run/authorities.crt\n")
    volumes = ["--volume", f"{folder}/pip.conf:/etc/pip.conf:ro", "--volume", "/etc/ssl/certs/ca-certificates.crt:/run/authorities.crt:ro"]
    buildah("build", "--isolation", "chroot", "--pull-never", *volumes, "-t", "steadyhand", "-f", ROOT / "Containerfile", wheel.parent)
    yield buildah
    shutil.rmtree(folder, ignore_errors=True)  # gigabytes


def test_the_image_moves_an_arm_as_an_ordinary_user(buildah, wheel):
    image = json.loads(buildah("inspect", "--type", "image", "steadyhand"))["OCIv1"]["config"]
    container = buildah("from", "--pull-never", "steadyhand").strip()

    def inside(*words):
        return buildah("run", "--isolation", "chroot", container, "--", "sh", "-c", 'exec "$@" 2>&1', "sh", *words)

    assert inside("id", "-u").strip() == "1000" and wheel.name.split("-")[1] in inside(*image["Entrypoint"], "--version")
    session = inside(*image["Entrypoint"], *image["Cmd"], "--headless", "--seconds", "3")
    assert re.search(r"engaged [1-9]", session), session
    [volume] = image["Volumes"]
    assert re.search(rf"recorded: {volume}/\S+\.mcap", session), session
    ports = re.findall(r"port: (\d+)", inside(*image["Entrypoint"], "config"))
    assert set(image["ExposedPorts"]) == {f"{port}/tcp" for port in ports} != set(), ports
