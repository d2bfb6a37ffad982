"""The bundled recording, live, through each arm: in this program, behind the fake Universal Robots controller, and over DDS
behind the reference controller of ROS 2.

    ./steadyhand && cmake --build build/release --target fake_ur_controller reference_controller
    .deps/venv/bin/python bench/arms.py --seconds 22

A row an arm: error of the glass to its target, what the witness saw of the commands, what was lost or late, and the largest
steps of the arm's set-points q, dq from cycle to cycle, dt apart, over all joints: of the position
|q_k - q_(k-1) - dt (dq_k + dq_(k-1)) / 2|, so beyond what the speeds explain; of the speed |dq_k - dq_(k-1)|; and by
differences of the positions the acceleration. Ordinary motion at the limit of 15 rad/s^2 changes the speed by 0.030 rad/s in 2 ms,
0.120 in 8 ms. An arm that takes positions alone has differences for speeds: its position step is dt / 2 times its speed step.
"""

import argparse
import json
import os
import random
import re
import signal
import subprocess
import tempfile
from pathlib import Path

from mcap.reader import make_reader

ROOT = Path(__file__).resolve().parents[1]
PROGRAM = os.environ.get("STEADYHAND_PROGRAM", str(ROOT / "build/release/steadyhand"))
FAKE = str(Path(PROGRAM).parent / "fake_ur_controller")
REFERENCE = str(Path(PROGRAM).parent / "reference_controller")
LOOPBACK = (  # DDS stays on this computer
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)

ARMS = {
    "in this program": None,
    "UR, clean": [],
    "UR, CB3 at 125 Hz": ["--cb3"],
    "UR, RTDE 1": ["--protocol", "1"],
    "UR, cable out 5 ms every second": ["--unplug-ms", "6", "--every", "1"],
    "UR, cable out 20 ms every second": ["--unplug-ms", "20", "--every", "1"],
    "ROS 2, clean": ["ros2"],
    "ROS 2, interpolates from the desired state": ["ros2", "--interpolate-from-desired-state"],
    "ROS 2, replaces at the stamp": ["ros2", "--allow-trajectory-replacement"],
    "ROS 2, lags by 8 ms each way": ["ros2", "--lag", "4"],
    "ROS 2, nothing through for 5 ms every second": ["ros2", "--unplug-ms", "6", "--every", "1"],
    "ROS 2, nothing through for 20 ms every second": ["ros2", "--unplug-ms", "20", "--every", "1"],
}


def start_fake(arguments):
    for _ in range(20):
        address = f"127.{random.randint(1, 254)}.{random.randint(1, 254)}.{random.randint(1, 254)}"
        ports = ["--rtde-port", "30004", "--script-port", "30001", "--dashboard-port", "29999"]
        process = subprocess.Popen([FAKE, "--address", address, *ports, *arguments], stdout=subprocess.PIPE, text=True)
        if process.stdout.readline().startswith("listening"):
            return address, process
        process.wait()
    raise SystemExit("no free address on the loopback")


def find(pattern, text, default="-"):
    match = re.search(pattern, text)
    return match.group(1).strip() if match else default


def largest_steps(recording):
    """Of the commands of a recording, as a controller would print them."""
    position = speed = acceleration = 0.0
    last = None
    with open(recording, "rb") as file:
        for _, _, message in make_reader(file).iter_messages(topics=["/joint_command"]):
            content = json.loads(message.data)
            now = (1e-9 * message.log_time, content["q"], content["dq"])
            dt = now[0] - last[0] if last else 0.0
            if 0.0 < dt < 1.5 / 500.0:  # not over cycles that were slept through
                for q0, dq0, q1, dq1 in zip(*last[1:], *now[1:]):
                    position = max(position, abs(q1 - q0 - 0.5 * dt * (dq1 + dq0)))
                    speed = max(speed, abs(dq1 - dq0))
                    acceleration = max(acceleration, abs(dq1 - dq0) / dt)
            last = now
    return f"position {1e3 * position:.4f} mrad, speed {speed:.4f} rad/s, largest acceleration {acceleration:.2f}"


def drive(arguments, seconds, rate):
    with tempfile.TemporaryDirectory() as folder:
        command = [PROGRAM, "demo", "--headless", "--seconds", str(seconds), "--rate", str(rate), "--sessions", folder]
        controller = ""
        if arguments is None:
            out = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        else:
            environment = {**os.environ, "ROS_DOMAIN_ID": str(random.randint(1, 100)), "CYCLONEDDS_URI": LOOPBACK}
            if arguments[:1] == ["ros2"]:
                process = subprocess.Popen(
                    [REFERENCE, *arguments[1:]], stdout=subprocess.PIPE, text=True, env=environment
                )
                process.stdout.readline()  # ready
                command += ["--arm", "ros2"]
            else:
                address, process = start_fake(arguments)
                command += ["--arm", "ur", "--host", address]
            try:
                command += ["--hand-on-hardware", "--speed", "1", "--yes", "--set", "arm.first_moves=0"]
                out = subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout
            finally:
                process.send_signal(signal.SIGTERM)
                controller, _ = process.communicate(timeout=20)
        sessions = sorted(Path(folder).glob("**/*.mcap"))
        report = subprocess.run([PROGRAM, "report", str(sessions[0])], capture_output=True, text=True).stdout if sessions else ""
        if arguments is None and sessions:
            controller = largest_steps(sessions[0])
    return out, controller, report


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=22.0)
    parser.add_argument("--rate", type=float, default=50.0, help="of the planner, Hz")
    parser.add_argument("--only", default="", help="arms whose row begins so")
    parser.add_argument("--verbose", action="store_true", help="what the programs say, too")
    options = parser.parse_args()
    print(
        "| arm | error RMS, mm | engaged, s | commands beyond a limit | deadlines missed | late plans "
        "| set-points lost or late | step of position, mrad | of speed, rad/s | largest acceleration, rad/s^2 | stops |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for name, arguments in ARMS.items():
        if not name.startswith(options.only):
            continue
        out, controller, report = drive(arguments, options.seconds, options.rate)
        if options.verbose:
            print(out, controller, report)
        cells = [
            find(r"Position error, RMS[^\d]*([\d.]+)", report),
            find(r"engaged ([\d.]+) s", out),
            find(r"(\d+) beyond a limit", out),
            find(r"cycles, (\d+) deadlines missed", out),
            find(r"failed, (\d+) came late", out),
            find(r"(\d+) (?:lost or late|cycles without)", controller),
            find(r"position ([\d.]+) mrad", controller),
            find(r"speed ([\d.]+) rad/s, largest acceleration", controller),
            find(r"largest acceleration ([\d.]+)", controller),
            find(r"; ([^;]*)\n", controller),
        ]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
