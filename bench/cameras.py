"""How far apart the exposure of pictures and the times of joints are: a dial of a simulated scene shows the time, a camera films it.
Prints the skew, and leaves a contact sheet where --sheet says.
"""

import argparse
import base64
import json
import os
import subprocess
import tempfile
from pathlib import Path

import av
import numpy as np
from mcap.reader import make_reader

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = Path(os.environ.get("STEADYHAND_PROGRAM", ROOT / "build/release/steadyhand"))

# Stands next to the arm; lengths in m. The dial reaches 5 rad/s within a second.
SCENE = """
<mujoco>
  <worldbody>
    <camera name="above" pos="0 -2 1" fovy="40"/>
    <body name="dial" pos="0 -2 0">
      <joint name="dial"/>
      <geom type="box" pos="0.12 0 0" size="0.1 0.02 0.01" rgba="1 0 0 1" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator><general joint="dial" biastype="affine" biasprm="0.5 0 -0.1"/></actuator>
</mujoco>
"""
TASK = """
instruction: Watch the dial.
scene: dial.xml
cameras: [above]
success:
  - {still: dial, speed: 0.0001}
"""


def record(folder, seconds, *options, check=True):
    """A session before the dial: its recording, and what the program said."""
    folder = Path(folder)
    (folder / "dial.xml").write_text(SCENE)
    (folder / "dial.yaml").write_text(TASK)
    command = [PROGRAM, "demo", "--headless", "--arm", "mujoco", "--task", folder / "dial.yaml", "--seconds", str(seconds), "--set", f"recording.folder={folder}"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, check=check, timeout=60 + 10 * seconds)
    return max(folder.glob("*.mcap"), default=None), done.stdout


def seconds_of(stamp):
    return stamp["sec"] + 1e-9 * stamp["nsec"]


def read(path, camera="above"):
    """Where the dial was: (t, angle) of the scene's states; and exposure and pixels of the pictures that show it."""
    dial, exposed, pictures = [], [], []
    decoder = av.CodecContext.create("h264", "r")
    decoder.flags |= av.codec.context.Flags.low_delay
    with open(path, "rb") as file:
        for _, channel, message in make_reader(file).iter_messages(topics=["/scene", f"/camera/{camera}"]):
            said = json.loads(message.data)
            if channel.topic == "/scene":
                q = said["things"][0]["pose"]["orientation"]
                dial.append((seconds_of(said["timestamp"]), 2.0 * np.arctan2(q["z"], q["w"])))
                continue
            exposed.append(seconds_of(said["timestamp"]))
            pictures += [frame.to_ndarray(format="rgb24") for frame in decoder.decode(av.Packet(base64.b64decode(said["data"])))]
    t, angle = np.array(dial).T
    return (t, np.unwrap(angle)), np.array(exposed), pictures


def angle_of(picture):
    """Of the red hand about the middle, rad."""
    red = (picture[:, :, 0].astype(int) - picture[:, :, 1]) > 80
    rows, columns = np.nonzero(red)
    height, width = red.shape
    return np.arctan2((height - 1) / 2 - rows.mean(), columns.mean() - (width - 1) / 2)


def skew(path):
    """s, of each picture: when the dial stood as it shows, less its exposure."""
    (t, angle), exposed, pictures = read(path)
    assert len(exposed) == len(pictures)
    errors = []
    for at, picture in zip(exposed, pictures):
        if not t[0] + 2.0 < at < t[-1] - 0.1:  # the dial turns evenly by then
            continue
        here = np.interp(at, t, angle)
        speed = (np.interp(at + 0.05, t, angle) - np.interp(at - 0.05, t, angle)) / 0.1
        errors.append(((angle_of(picture) - here + np.pi) % (2.0 * np.pi) - np.pi) / speed)
    return np.array(errors)


def contact_sheet(pictures, path, columns=6, rows=4):
    from PIL import Image

    chosen = [pictures[k] for k in np.linspace(0, len(pictures) - 1, columns * rows).astype(int)]
    Image.fromarray(np.vstack([np.hstack(chosen[r * columns : (r + 1) * columns]) for r in range(rows)])).save(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="of the session")
    parser.add_argument("--sheet", help="PNG for a contact sheet of the pictures")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path, said = record(folder, arguments.seconds)
        errors = 1e3 * skew(path)
        print("".join(line for line in said.splitlines(keepends=True) if line.startswith(("control", "camera"))), end="")
        print(f"skew               of {len(errors)} pictures: mean {errors.mean():.2f}, RMS {np.sqrt((errors**2).mean()):.2f}, largest {np.abs(errors).max():.2f} ms; half a frame is {500 / 15:.1f} ms")
        if arguments.sheet:
            contact_sheet(read(path)[2], arguments.sheet)


if __name__ == "__main__":
    main()
