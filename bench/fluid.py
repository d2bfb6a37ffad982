"""What a fluid simulation says of the glass (PyPI pysplishsplash 2.19 with numpy, in an environment of its own: it needs nothing of ours
but the motion):

    python bench/fluid.py HAND --profile carry --write motion.npz      with build/release/python on PYTHONPATH; HAND: a file, or a name of hands.py
    python bench/fluid.py --motion motion.npz --keep seen.npz          in the other environment; a second takes half a minute of a core
    python bench/fluid.py --draw seen.npz ... --picture crest.png      with matplotlib

Where it ends with a segmentation fault its own libGL* clash with the system's: link the names in pysplishsplash.libs to those of the
system (apt: libgl1 libopengl0 libglx0 libglu1).

The glass moves and turns as the commands have it; DFSPH, particles of 2 mm radius. A column settles in a high glass first. The motion
begins with these particles in a glass whose rim is 10 mm above the level at which they came to rest, and 50 mm above the tool's origin.
The liquid is some 70 mm deep, not 90, which is the same to the first mode (its frequency changes by less than a thousandth). The liquid has no viscosity
of its own: that of the package's models is for pools of metres, quenches this wave within a period, and is unstable at these steps. What
the method itself damps is a damping ratio of 0.03 to 0.04, where water has 0.006; its frequency is that of the first mode.

Says which share of the liquid left the glass, and, beside the first mode's wave at the wall as carrying.py has it, how high the crest
stood there (the fourth highest particle) and a plane through the surface.
"""

import argparse
import json
import math
import sys
import tempfile
from pathlib import Path

import numpy as np

RADIUS, HEIGHT, FILL, PARTICLE = 0.035, 0.1, 0.09, 0.002
WALL = RADIUS + 0.8 * PARTICLE  # m, radius at which the walls are: the outer particles keep so far off that their edges are at RADIUS
DEPTH = 0.1  # m, of the column before it settles
STEP = 0.0005  # s
DAMPING = 0.035  # what the method does to a free wave
SETTLING, REST = 2.0, 0.5  # s: of the column, and of the liquid before the motion
GRAVITY = np.array([0.0, 0.0, -9.81])


def write_motion(arguments):
    """t (s), the tool's pose, and the wave (m), with water's damping and with that of the simulation, at each command, to a file."""
    import steadyhand
    from hands import find_hands
    from liquid import swing

    robot = steadyhand.Robot("ur5e")
    if Path(arguments.hand).is_file():
        found = find_hands([arguments.hand])
    else:
        found = [hand for hand in find_hands() if hand.name == arguments.hand]
    if not found:
        raise SystemExit(f"'{arguments.hand}' is neither a recording of a hand that moves nor the name of a hand in hands.py")
    hand = found[0]
    run = steadyhand.replay(hand.path, arguments.profile, arguments.rate, robot=robot, track=hand.track, scale=hand.scale, until=arguments.seconds)
    commands = run.commands
    force = robot.local_acceleration(commands.q, commands.dq, commands.ddq)
    np.savez(arguments.write, t=commands.t - commands.t[0], tool=robot.fk(commands.q), wave=swing(force)[0],
             damped=swing(force, zeta=DAMPING)[0], name=f"{hand.name}, {Path(arguments.profile).stem}")  # fmt: skip


def glass_mesh(path, height, segments=72, rings=24):
    """An open cylinder of triangles, axis along z, its bottom at 0."""
    points, faces = [(0.0, 0.0, 0.0)], []
    for ring in range(rings + 1):
        for i in range(segments):
            a = 2 * math.pi * i / segments
            points.append((WALL * math.cos(a), WALL * math.sin(a), height * ring / rings))
    at = lambda ring, i: 2 + ring * segments + i % segments
    for i in range(segments):
        faces.append((1, at(0, i + 1), at(0, i)))
        for ring in range(rings):
            faces += [(at(ring, i), at(ring, i + 1), at(ring + 1, i)), (at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i))]
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points) + "".join(f"f {a} {b} {c}\n" for a, b, c in faces))


def column():
    """Particles (k, 3) that are to settle: a lattice, off the walls, and wider than at rest. What is denser than at rest in the first step,
    be it by the walls' share, bursts."""
    gap = 2.2 * PARTICLE
    side = np.arange(-(RADIUS // gap), RADIUS // gap + 1) * gap
    x, y, z = np.meshgrid(side, side, np.arange(gap, DEPTH, gap), indexing="ij")
    return np.stack([x, y, z], -1)[np.hypot(x, y) < WALL - gap]


def write_particles(path, positions):
    """Partio's text format."""
    rows = "".join(f"{i} {x:.8g} {y:.8g} {z:.8g} 0 0 0\n" for i, (x, y, z) in enumerate(positions))
    path.write_text(f"ATTRIBUTES\nid position velocity\nTYPES\nI V V\nNUMBER_OF_PARTICLES: {len(positions)}\nBEGIN DATA\n{rows}")


def scene(folder, seconds):
    return {
        "Configuration": {
            "particleRadius": PARTICLE, "density0": 1000, "simulationMethod": 4, "gravitation": GRAVITY.tolist(), "timeStepSize": STEP,
            "cflMethod": 0, "maxIterations": 100, "maxError": 0.05, "maxIterationsV": 100,
            "maxErrorV": 0.1, "boundaryHandlingMethod": 0, "stopAt": seconds,
        },
        "Materials": [{"id": "Fluid", "viscosityMethod": 0}],
        "RigidBodies": [{"geometryFile": str(folder / "glass.obj"), "translation": [0, 0, 0], "rotationAxis": [1, 0, 0], "rotationAngle": 0,
                         "scale": [1, 1, 1], "isDynamic": False, "isAnimated": True, "isWall": False, "samplingMode": 0}],
        "FluidModels": [{"id": "Fluid", "particleFile": str(folder / "liquid.pda"), "translation": [0, 0, 0], "scale": [1, 1, 1]}],
    }  # fmt: skip


class Path3:
    """Where the glass is, and how fast, between the commands' poses (k, 4, 4) at t; it stands before them."""

    def __init__(self, t, poses):
        self.t, self.p, self.R = t, poses[:, :3, 3], poses[:, :3, :3]
        turn = np.swapaxes(self.R[:-1], 1, 2) @ self.R[1:]
        skew = 0.5 * np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], -1)
        self.turned = skew  # rad in an interval, in the glass's axes; they are small

    def at(self, now):
        """Position, rotation, velocity and angular velocity."""
        if now <= self.t[0]:
            return self.p[0], self.R[0], np.zeros(3), np.zeros(3)
        i = min(np.searchsorted(self.t, now, side="right") - 1, len(self.t) - 2)
        step = self.t[i + 1] - self.t[i]
        share = min((now - self.t[i]) / step, 1.0)
        w = share * self.turned[i]
        angle = np.linalg.norm(w)
        K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        a, b = (np.sin(angle) / angle, (1 - np.cos(angle)) / angle**2) if angle > 1e-9 else (1.0, 0.5)
        R = self.R[i] @ (np.eye(3) + a * K + b * K @ K)
        return self.p[i] + share * (self.p[i + 1] - self.p[i]), R, (self.p[i + 1] - self.p[i]) / step, R @ self.turned[i] / step


def quaternion(R):
    """x, y, z, w; of a rotation by less than a half turn."""
    w = 0.5 * math.sqrt(max(1e-12, 1.0 + np.trace(R)))
    return np.array([*(np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4 * w)), w])


def plane_height(particles):
    """m, at the wall, of the plane through the highest particles of columns as wide as a particle."""
    cells = np.round(particles[:, :2] / (2 * PARTICLE)).astype(int)
    order = np.lexsort((-particles[:, 2], cells[:, 1], cells[:, 0]))
    _, first = np.unique(cells[order], axis=0, return_index=True)
    top = particles[order[first]]
    slope = np.linalg.lstsq(np.c_[top[:, :2], np.ones(len(top))], top[:, 2], rcond=None)[0]
    return RADIUS * np.hypot(slope[0], slope[1])


def run(seconds, height, particles, path=None):
    """Lets the particles move in a glass of this height, which goes along the path, the origin of its poses at the glass's bottom. Looks at
    them every 20 ms: time, share outside of the glass, how high they stand at the wall, and plane_height (m). Returns that, and where they
    are last."""
    import pysplishsplash as sph

    seen, last = [], None
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        glass_mesh(folder / "glass.obj", height)
        write_particles(folder / "liquid.pda", particles)
        (folder / "scene.json").write_text(json.dumps(scene(folder, seconds)))
        base = sph.Exec.SimulatorBase()
        base.init(sceneFile=str(folder / "scene.json"), outputDir=str(folder / "out"), useGui=False, useCache=False, initialPause=False)
        base.initSimulation()

        def look():
            nonlocal last
            simulation, now = sph.Simulation.getCurrent(), sph.TimeManager.getCurrent().getTime()
            p, R = np.zeros(3), np.eye(3)
            if path:
                p, R, v, w = path.at(now)
                body = simulation.getBoundaryModel(0).getRigidBodyObject()
                body.setPosition(p)
                body.setRotation(quaternion(R))
                body.setVelocity(v)
                body.setAngularVelocity(w)
            if seen and now < seen[-1][0] + 0.02:
                return
            fluid = simulation.getFluidModel(0)
            last = (np.array([fluid.getPosition(i) for i in range(fluid.numActiveParticles())]) - p) @ R  # in the glass
            r, z = np.hypot(last[:, 0], last[:, 1]), last[:, 2]
            kept = (r < WALL + PARTICLE) & (z > -2 * PARTICLE) & (z < height + 0.03)
            wall = z[kept & (r > 0.7 * RADIUS)]
            crest = np.sort(wall)[-4] if len(wall) > 4 else 0.0
            seen.append((now, 1.0 - kept.mean(), crest, plane_height(last[kept]) if kept.sum() > 100 else np.nan))

        base.setTimeStepCB(look)
        base.runSimulation()
        base.cleanup()
    return np.array(seen).T, last


def settled_column(path):
    """Particles at rest, and how high they stand at the wall; from the file, where it is there."""
    if path and path.exists():
        found = np.load(path)
        return found["particles"], float(found["rest"])
    (now, _, stands, _), particles = run(SETTLING, HEIGHT + 0.05, column())
    rest = np.median(stands[now > 0.8 * SETTLING])
    if path:
        np.savez(path, particles=particles, rest=rest)
    return particles, rest


def simulate(motion, arguments):
    t, tool = motion["t"], motion["tool"]
    settled, rest = settled_column(arguments.settled)
    rim = rest + HEIGHT - FILL
    bottom = np.linalg.inv(tool[0]) @ tool  # of the tool's origin, in axes of the tool as it begins
    bottom[:, :3, 3] += (bottom[:, :3, 2] - [0, 0, 1]) * (HEIGHT / 2 - rim)
    (now, lost, stands, plane_seen), _ = run(REST + t[-1], rim, settled, Path3(REST + t, bottom))
    moving = now > REST
    rest = np.median(stands[~moving][len(stands[~moving]) // 2 :])
    model, damped = (np.interp(now[moving] - REST, t, motion[key]) for key in ("wave", "damped"))
    waves = stands[moving] - rest
    begun = lost[~moving][-1]
    if arguments.keep:
        np.savez(arguments.keep, t=now[moving] - REST, crest=waves, plane=model, damped=damped, plane_seen=plane_seen[moving], spilled=lost[moving] - begun, rim=rim - rest, name=motion["name"])
    print(f"{motion['name']}: {len(settled)} particles, at rest at {1e3 * rest:.1f} mm, the rim {1e3 * (rim - rest):.1f} mm above; {100 * begun:.2f} % lost before the motion")
    off = plane_seen[moving] - damped
    print(f"spilled {100 * (lost[-1] - begun):.2f} %; largest crest over rest {1e3 * waves.max():.1f} mm, plane {1e3 * np.nanmax(plane_seen[moving]):.1f} mm, first mode {1e3 * model.max():.1f} mm, "
          f"damped as here {1e3 * damped.max():.1f} mm; plane and the damped mode apart {1e3 * np.sqrt(np.nanmean(off**2)):.1f} mm RMS of {1e3 * np.sqrt(np.mean(damped**2)):.1f}, "
          f"correlation {np.corrcoef(np.nan_to_num(plane_seen[moving]), damped)[0, 1]:.2f}; "
          f"crest less first mode: mean {1e3 * np.mean(waves - model):.1f}, 99 % {1e3 * np.percentile(waves - model, 99):.1f} mm")  # fmt: skip


def draw(paths, picture):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(len(paths), sharex=True, figsize=(8, 1.0 + 1.5 * len(paths)), layout="constrained", squeeze=False)
    for ax, path in zip(axes[:, 0], paths):
        seen = np.load(path)
        ax.plot(seen["t"], 1e3 * seen["crest"], color="#2f7fd0", lw=1, label="crest, fluid simulation")
        ax.plot(seen["t"], 1e3 * seen["plane_seen"], color="#8a8f98", lw=1.2, label="plane through its surface")
        ax.plot(seen["t"], 1e3 * seen["damped"], color="#16a085", lw=1.2, label="first mode, damped as there")
        ax.plot(seen["t"], 1e3 * seen["plane"], color="#16a085", lw=0.8, ls=":", label="first mode of water")
        ax.axhline(1e3 * (HEIGHT - FILL), color="#c62828", lw=0.8, ls="--", label="rim")
        ax.set(ylim=(-4, 20), ylabel="mm")
        ax.set_title(f"{seen['name']}: {100 * seen['spilled'][-1]:.2f} % spilled", fontsize=9, loc="left")
        ax.grid(alpha=0.25)
    axes[0, 0].legend(fontsize=7, ncols=5, loc="upper right")
    axes[-1, 0].set_xlabel("s")
    figure.savefig(picture, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("hand", nargs="?", help="a recording, or the name of one in hands.py")
    parser.add_argument("--profile", default="carry")
    parser.add_argument("--rate", type=float, default=20.0)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--write", type=Path, help="the motion only, to this file")
    parser.add_argument("--motion", type=Path, help="simulate the one of this file")
    parser.add_argument("--keep", type=Path, help="what was seen")
    parser.add_argument("--settled", type=Path, help="the column that has come to rest: read, or written where there is none")
    parser.add_argument("--draw", nargs="+", type=Path, help="what was seen, of several")
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    if arguments.write:
        return write_motion(arguments)
    if arguments.draw:
        return draw(arguments.draw, arguments.picture)
    return simulate(np.load(arguments.motion), arguments)


if __name__ == "__main__":
    sys.exit(main())
