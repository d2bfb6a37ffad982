"""What a fluid simulation says of the glass (PyPI pysplishsplash 2.19 with numpy, in an environment of its own: it needs nothing of ours
but the motion):

    python bench/fluid.py HAND --profile carry --write motion.npz      with build/release/python on PYTHONPATH; HAND: a file, or a name of hands.py
    python bench/fluid.py --motion motion.npz --keep seen.npz          in the other environment; a second takes ten and more
    python bench/fluid.py --draw seen.npz ... --picture crest.png      with matplotlib

Where it ends with a segmentation fault its own libGL* clash with the system's: link the names in pysplishsplash.libs to those of the
system (apt: libgl1 libopengl0 libglx0 libglu1).

The strips of particles fill the glass to some 70 mm: the rim is put where the liquid that has come to rest has 10 mm left, which is the
same to the first mode (its frequency changes by less than a thousandth above 50 mm). The glass stands still and the specific force of the commands turns about it (its own turning adds forces that are left out); DFSPH,
particles of 2.5 mm radius.

**Known wrong**: the strips burst at the begin, before they rest, so that the rim stands some 17 mm too high and a share of the liquid
is gone; what it says of spilling does not count until the liquid begins at rest.

Says which share of the liquid left the glass, and how high the crest stood at the wall beside the first mode's
plane, as carrying.py has it.
"""

import argparse
import json
import math
import sys
import tempfile
from pathlib import Path

import numpy as np

RADIUS, HEIGHT, FILL, PARTICLE = 0.035, 0.1, 0.09, 0.0025
REST = 1.0  # s, in which the liquid comes to rest before the motion


def write_motion(arguments):
    """t (s), and the specific force (m/s^2) and the wave (m) at each command, to a file."""
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
    np.savez(arguments.write, t=commands.t - commands.t[0], force=force, wave=swing(force)[0], name=f"{hand.name}, {Path(arguments.profile).stem}")


def glass_mesh(path, height, segments=72, rings=24):
    """An open cylinder of triangles, axis along y."""
    points, faces = [(0.0, 0.0, 0.0)], []
    for ring in range(rings + 1):
        for i in range(segments):
            a = 2 * math.pi * i / segments
            points.append((RADIUS * math.cos(a), height * ring / rings, RADIUS * math.sin(a)))
    at = lambda ring, i: 2 + ring * segments + i % segments
    for i in range(segments):
        faces.append((1, at(0, i), at(0, i + 1)))
        for ring in range(rings):
            faces += [(at(ring, i), at(ring + 1, i), at(ring, i + 1)), (at(ring, i + 1), at(ring + 1, i), at(ring + 1, i + 1))]
    path.write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points) + "".join(f"f {a} {b} {c}\n" for a, b, c in faces))


def scene(folder, seconds, height):
    """The glass, and strips of liquid that fill it as a disc would."""
    glass_mesh(folder / "glass.obj", height)
    gap, blocks = 2 * PARTICLE, []
    inside = RADIUS - PARTICLE  # of the particles' middles' ball
    columns = int(inside / gap) // 2 * 2
    for i in range(-columns, columns, 2):  # a block has two columns of particles at least
        half = math.sqrt(max(0.0, inside**2 - (max(abs(i), abs(i + 1)) * gap) ** 2))
        if half > 1.5 * gap:
            blocks.append({"denseMode": 0, "start": [(i - 1.02) * gap, 0.0, -half - PARTICLE], "end": [(i + 2.02) * gap, FILL + PARTICLE, half + PARTICLE], "id": "Fluid"})
    return {
        "Configuration": {
            "particleRadius": PARTICLE, "density0": 1000, "simulationMethod": 4, "gravitation": [0, -9.81, 0], "timeStepSize": 0.001,
            "cflMethod": 1, "cflFactor": 1, "cflMaxTimeStepSize": 0.002, "maxIterations": 100, "maxError": 0.05, "maxIterationsV": 100,
            "maxErrorV": 0.1, "boundaryHandlingMethod": 0, "stopAt": seconds,
        },
        "Materials": [{"id": "Fluid", "viscosityMethod": 1, "viscosity": 0.002}],
        "RigidBodies": [{"geometryFile": str(folder / "glass.obj"), "translation": [0, 0, 0], "rotationAxis": [1, 0, 0], "rotationAngle": 0,
                         "scale": [1, 1, 1], "isDynamic": False, "isWall": False}],
        "FluidBlocks": blocks,
    }  # fmt: skip


def run(seconds, height, force_at):
    """Looks at the liquid, every 20 ms: time, share outside of the glass, and how high it stands at the wall (m)."""
    import pysplishsplash as sph

    seen = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.json").write_text(json.dumps(scene(folder, seconds, height)))
        base = sph.Exec.SimulatorBase()
        base.init(sceneFile=str(folder / "scene.json"), outputDir=str(folder / "out"), useGui=False, useCache=False, initialPause=False)
        base.initSimulation()

        def look():
            simulation, now = sph.Simulation.getCurrent(), sph.TimeManager.getCurrent().getTime()
            f = force_at(now)
            simulation.setVec3ValueReal(simulation.GRAVITATION, [-f[0], -f[2], -f[1]])  # the glass's z is y here
            if seen and now < seen[-1][0] + 0.02:
                return
            fluid = simulation.getFluidModel(0)
            p = np.array([fluid.getPosition(i) for i in range(fluid.numActiveParticles())])
            r = np.hypot(p[:, 0], p[:, 2])
            kept = (r < RADIUS + PARTICLE) & (p[:, 1] > -2 * PARTICLE) & (p[:, 1] < height + 0.03)
            wall = p[kept & (r > 0.7 * RADIUS), 1]
            seen.append((now, 1.0 - kept.mean(), np.sort(wall)[-4] if len(wall) > 4 else 0.0))

        base.setTimeStepCB(look)
        base.runSimulation()
        base.cleanup()
    return np.array(seen).T


def simulate(motion, keep):
    t, force, plane = motion["t"], motion["force"], motion["wave"]
    upright = np.array([0.0, 0.0, 9.81])
    now, _, stands = run(REST, HEIGHT + 0.05, lambda _: upright)
    rest = np.median(stands[now > 0.6 * REST])
    led = lambda now: upright if now < REST else np.array([np.interp(now - REST, t, force[:, i]) for i in range(3)])
    now, lost, stands = run(REST + t[-1], rest + HEIGHT - FILL, led)
    moving = now > REST
    model = np.interp(now[moving] - REST, t, plane)
    waves = stands[moving] - rest
    if keep:
        np.savez(keep, t=now[moving] - REST, crest=waves, plane=model, spilled=lost[moving] - lost[~moving][-1], name=motion["name"])
    print(f"at rest {1e3 * rest:.0f} mm; spilled {100 * (lost[-1] - lost[~moving][-1]):.2f} %; crest over rest: largest {1e3 * waves.max():.1f} mm, plane's {1e3 * model.max():.1f} mm; "
          f"crest less plane: mean {1e3 * np.mean(waves - model):.1f}, 99 % {1e3 * np.percentile(waves - model, 99):.1f} mm; correlation {np.corrcoef(waves, model)[0, 1]:.2f}")  # fmt: skip


def draw(paths, picture):
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(len(paths), sharex=True, figsize=(8, 1.2 + 1.5 * len(paths)), layout="constrained", squeeze=False)
    for ax, path in zip(axes[:, 0], paths):
        seen = np.load(path)
        ax.plot(seen["t"], 1e3 * seen["crest"], color="#2f7fd0", lw=1, label="crest, fluid simulation")
        ax.plot(seen["t"], 1e3 * seen["plane"], color="#16a085", lw=1.2, label="first mode's plane")
        ax.axhline(1e3 * (HEIGHT - FILL), color="#c62828", lw=0.8, ls="--", label="rim")
        ax.set(ylim=(-2, 20), ylabel="mm")
        ax.set_title(f"{seen['name']}: {100 * seen['spilled'][-1]:.2f} % spilled", fontsize=9, loc="left")
        ax.grid(alpha=0.25)
    axes[0, 0].legend(fontsize=8, ncols=3, loc="upper right")
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
    parser.add_argument("--draw", nargs="+", type=Path, help="what was seen, of several")
    parser.add_argument("--picture", type=Path)
    arguments = parser.parse_args()
    if arguments.write:
        return write_motion(arguments)
    if arguments.draw:
        return draw(arguments.draw, arguments.picture)
    return simulate(np.load(arguments.motion), arguments.keep)


if __name__ == "__main__":
    sys.exit(main())
