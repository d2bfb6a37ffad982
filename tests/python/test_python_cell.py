"""steadyhand.Cell and Object: what stands around the arm, in plans and replays, and what is refused."""

import math

import numpy as np
import pytest
import steadyhand
from steadyhand import Cell, Object, Planner, SteadyhandError, pose


def ahead(robot, x=0.0, y=0.0, z=0.0):
    T = robot.fk(robot.home)
    T[:3, 3] += [x, y, z]
    return T


def glide(planner, robot, target, seconds=3.0, begin=0.0):
    """Plans, 20 a second, towards a target; what each says."""
    plans = [planner.update(target, begin + 0.05 * i) for i in range(int(20 * seconds))]
    return plans, [plan.q[0] for plan in plans]


FLOOR = Object.half_space("floor", pose([0, 0, 0.2]), may_be_touched_by=["shoulder_link", "upper_arm_link"])
SHAPES = {
    "sphere": lambda T: Object.sphere("it", T, 0.1),
    "capsule": lambda T: Object.capsule("it", T, radius=0.08, length=0.2),
    "cylinder": lambda T: Object.cylinder("it", T, radius=0.1, length=0.2),
    "box": lambda T: Object.box("it", T, [0.2, 0.2, 0.2], rounding=0.02),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_the_arm_stays_out_of_what_is_in_its_way(robot, shape):
    target = ahead(robot, y=0.4)
    it = SHAPES[shape](pose(ahead(robot, y=0.35)[:3, 3]))
    blind = Cell([it])
    _, through = glide(Planner(robot), robot, target)
    plans, around = glide(Planner(robot, cell=[it]), robot, target)
    assert min(blind.distances(robot, q)["it"] for q in through) < 0
    assert min(blind.distances(robot, q)["it"] for q in around) > 0.01 - 2e-5
    held = [plan for plan in plans if plan.active == "obstacle"]
    assert held and all(plan.active_names[1] == "it" for plan in held)
    assert {plan.active_names[0] for plan in held} <= {body["name"] for body in robot.description["bodies"]}


def test_a_floor_holds_the_glass_up(robot):
    _, configurations = glide(Planner(robot, cell=[FLOOR]), robot, ahead(robot, z=-0.6))
    lowest = min(Cell([FLOOR]).distances(robot, q)["floor"] for q in configurations)
    assert 0.01 - 2e-5 < lowest < 0.03 < Cell([FLOOR]).distances(robot, robot.home)["floor"]


def test_objects_come_and_go(robot):
    planner, target = Planner(robot, cell=[]), ahead(robot, y=0.4)
    wall = Object.box("wall", pose(ahead(robot, y=0.3)[:3, 3]), [1.0, 0.05, 1.0])
    planner.set_cell([wall], t=0.0)
    plans, before = glide(planner, robot, target)
    assert plans[-1].active == "obstacle" and robot.fk(before[-1])[1, 3] < target[1, 3] - 0.1
    planner.set_cell([], t=3.0)
    _, after = glide(planner, robot, target, begin=3.0)
    assert abs(robot.fk(after[-1])[1, 3] - target[1, 3]) < 0.01


def test_what_is_carried_is_a_part_of_the_arm(robot):
    """A rod below the glass stays above a floor that it would be in if the glass went down alone; let go of, it stands."""
    rod = Object.capsule("rod", pose(ahead(robot, z=-0.1)[:3, 3]), radius=0.01, length=0.06)
    taken = Cell([FLOOR, rod]).attach("rod", robot, robot.home)
    assert [o["attached"] for o in taken.description["objects"]] == [False, True]
    _, alone = glide(Planner(robot, cell=[FLOOR]), robot, ahead(robot, z=-0.6))
    plans, way = glide(Planner(robot, cell=taken), robot, ahead(robot, z=-0.6))
    assert min(taken.distances(robot, q)["floor"] for q in alone) < -0.02
    assert min(taken.distances(robot, q)["floor"] for q in way) > 0.01 - 2e-5
    assert ("rod", "floor") in {plan.active_names for plan in plans}
    left = taken.detach("rod", robot, way[-1]).description["objects"][1]
    expected = robot.fk(way[-1]) @ np.linalg.inv(robot.fk(robot.home)) @ rod.T_base_object
    assert not left["attached"] and np.allclose(left["origin"], expected, atol=1e-9)
    for wrong in (lambda: taken.attach("rod", robot, robot.home), lambda: taken.attach("floor", robot, robot.home),
                  lambda: taken.attach("rods", robot, robot.home), lambda: taken.detach("floor", robot, robot.home)):  # fmt: skip
        with pytest.raises(SteadyhandError, match="rod|floor"):
            wrong()
    with pytest.raises(ValueError, match="one number for each joint"):
        taken.detach("rod", robot, [0.0])


def test_what_flies_is_where_its_velocity_says(robot):
    """It was set at t = 10 s, and comes past the glass at 11 s."""
    ball = Object.sphere("ball", ahead(robot, y=-0.5, z=0.1), 0.05, velocity=[0, 0.5, 0])
    planner = Planner(robot, cell=[])
    planner.reset(t=10.0)
    planner.set_cell([ball], t=10.0)
    _, configurations = glide(planner, robot, ahead(robot), seconds=2.0, begin=10.0)
    aside = [np.linalg.norm(robot.fk(q)[:3, 3] - ahead(robot)[:3, 3]) for q in configurations]
    assert np.argmax(aside) in range(15, 30) and max(aside) > 0.01 and aside[-1] < 0.01


def test_cells_by_name_and_what_they_tell(robot):
    table = Cell("table")
    assert table.name == "table" and "table" in table.object_names
    assert [each["name"] for each in table.description["objects"]] == list(table.object_names)
    assert Cell("none").object_names == ()
    box = Cell([Object.box("box", pose([1, 0, 0]), [0.2, 0.4, 0.6], rounding=0.05)]).description["objects"][0]
    assert box["shape"] == "box" and np.allclose(box["origin"], pose([1, 0, 0]))
    held = Cell([Object.sphere("all may", pose(), 3.0, may_be_touched_by=[link["name"] for link in robot.description["bodies"]])])
    assert math.isinf(held.distances(robot, robot.home)["all may"])


def test_a_replay_keeps_clear_and_tells_how_far(robot):
    t = np.arange(0.0, 3.0, 0.01)
    T = pose(np.column_stack([0.3 * np.sin(2 * t), 0 * t, 0 * t]), np.tile([0.0, 0.0, 0.0, 1.0], (len(t), 1)))
    free = steadyhand.replay((t, T), robot=robot, scale=1.0, cell="none")
    assert free.steps.object_distances == {}
    post = Object.capsule("post", pose(robot.fk(free.steps.q[20])[:3, 3]), 0.03, 0.5)
    held = steadyhand.replay((t, T), robot=robot, scale=1.0, cell=[post])
    assert min(Cell([post]).distances(robot, q)["post"] for q in free.commands.q[::10]) < 0
    distance = held.steps.object_distances["post"]
    assert distance.shape == held.steps.t.shape and 0.005 < distance.min() < 0.02
    i = int(distance.argmin())
    assert abs(Cell([post]).distances(robot, held.steps.q[i])["post"] - distance[i]) < 1e-9


BAD = {
    "no radius": (lambda: [Object.sphere("it", pose(), 0.0)], SteadyhandError, "radius"),
    "rounder than it is": (lambda: [Object.box("it", pose(), [0.1, 0.1, 0.1], rounding=0.2)], SteadyhandError, "object 'it'"),
    "NaN": (lambda: [Object.sphere("it", pose(), math.nan)], ValueError, "it: radius"),
    "a size too few": (lambda: [Object.box("it", pose(), [0.1, 0.1])], ValueError, "it: size has shape (2,); expected (3,)"),
    "no pose": (lambda: [Object.sphere("it", 2 * np.eye(4), 0.1)], SteadyhandError, "it: T_base_object is no pose"),
    "a position": (lambda: [Object.sphere("it", [0, 0, 1], 0.1)], ValueError, "it: T_base_object has shape (3,); expected (4, 4)"),
    "a margin below 0": (lambda: [Object.sphere("it", pose(), 0.1, margin=-1)], SteadyhandError, "margin is -1 m; it must be from 0 to 1"),
    "names as text": (lambda: [Object.sphere("it", pose(), 0.1, may_be_touched_by="tool")], TypeError, "a list of names, not 'tool'"),
    "an unknown link": (lambda: [Object.sphere("it", pose(), 0.1, may_be_touched_by=["gripper"])], SteadyhandError, "no body or link 'gripper'"),
    "no name": (lambda: [Object.sphere("", pose(), 0.1)], SteadyhandError, "has no name"),
    "two of one name": (lambda: [Object.sphere("it", pose([3, 0, 0]), 0.1)] * 2, SteadyhandError, "two of this name"),
    "too many": (lambda: [Object.sphere(f"{i}", pose([3, 0, 0]), 0.1) for i in range(65)], SteadyhandError, "at most 64"),
    "no object": (lambda: ["ball"], TypeError, "made of steadyhand.Object, not of str"),
    "an unknown cell": (lambda: "tabel", SteadyhandError, "table"),
    "no such file": (lambda: "nowhere/cell.yaml", FileNotFoundError, "nowhere/cell.yaml"),
    "a number": (lambda: 7, TypeError, "int"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_is_refused(robot, case):
    make, error, words = BAD[case]
    with pytest.raises(error) as raised:
        Planner(robot, cell=make())
    assert words in str(raised.value)


def test_a_planner_that_was_given_no_cell_says_what_to_do(robot):
    with pytest.raises(SteadyhandError, match=r"cell=\[\] says"):
        Planner(robot).set_cell([Object.sphere("it", pose([3, 0, 0]), 0.1)], t=0.0)


def test_a_cell_that_is_refused_leaves_the_last_one(robot):
    planner = Planner(robot, cell=[FLOOR])
    with pytest.raises(SteadyhandError):
        planner.set_cell([Object.sphere("it", pose(), 0.0)], t=0.0)
    plans, _ = glide(planner, robot, ahead(robot, z=-0.6))
    assert plans[-1].active == "obstacle" and plans[-1].active_names[1] == "floor"
