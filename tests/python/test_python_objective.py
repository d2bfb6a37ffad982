"""Objectives written in Python: the plans are those of the same term in C++, and what goes wrong in one reaches its caller."""

import numpy as np
import pytest
import steadyhand


class Effort(steadyhand.Objective):
    """The library's acceleration term, u' diag(w) u."""

    name, weight_count = "effort", 0

    def value(self, node, weight):
        return weight @ node.ddq**2

    def gradient(self, node, weight):
        return np.concatenate([0 * node.q, 0 * node.q, 2 * weight * node.ddq])

    def hessian(self, node, weight):
        return np.diag(np.concatenate([0 * node.q, 0 * node.q, 2 * weight]))


class Nearness(steadyhand.Objective):
    """The library's position term, |p - p_ref|^2, without derivatives."""

    name, acts_on, weight_count = "nearness", "states", 3

    def value(self, node, weight):
        assert node.ddq is None
        return weight @ (node.T_base_tool - node.T_reference)[:3, 3] ** 2


class Given(steadyhand.Objective):
    """Answers what it is told."""

    name = "given"

    def __init__(self, value=0.0, gradient=None):
        self.answers = value, gradient

    def value(self, node, weight):
        return self.answers[0](node) if callable(self.answers[0]) else self.answers[0]

    def gradient(self, node, weight):
        return np.zeros(18) if self.answers[1] is None else self.answers[1]

    def hessian(self, node, weight):
        return np.zeros((18, 18))


def drive(planner, steps):
    T, rows = planner.robot.fk(planner.robot.home), []
    for i in range(steps):
        T[1, 3] += 0.01
        plan = planner.update(T, 0.05 * i)
        assert plan.status == "solved"
        rows.append((plan.q[: planner.horizon], plan.solve_us))
    return np.array([q for q, _ in rows]), np.median([us for _, us in rows])


def test_the_plans_are_those_of_the_same_term_in_cpp(robot):
    ours = steadyhand.Planner(robot, "waiter", objectives=[Effort()], weights={"acceleration": 0.0, "effort": 0.02})
    assert list(ours.weights)[-1] == "effort" and (ours.weights["effort"] == [0.02] * 6).all()
    (q, slow), (expected, fast) = drive(ours, 30), drive(steadyhand.Planner(robot, "waiter", weights={"acceleration": 0.02}), 30)
    print(f"with derivatives in Python: {slow:.0f} us a plan, {slow / fast:.0f} times the library's")
    assert np.abs(q - expected).max() < 1e-5


def test_differences_stand_in_for_derivatives(robot):
    ours = steadyhand.Planner(robot, "waiter", objectives=[Nearness()], weights={"position": 0.0, "nearness": 500.0})
    (q, slow), (expected, fast) = drive(ours, 6), drive(steadyhand.Planner(robot, "waiter"), 6)
    print(f"with differences: {slow:.0f} us a plan, {slow / fast:.0f} times the library's")
    assert np.abs(q - expected).max() < 1e-4


def test_it_is_part_of_a_replay(robot):
    t = np.arange(0.0, 0.5, 0.011)
    T = steadyhand.pose(np.column_stack([0 * t, 0.2 * t, 0 * t]), np.tile([0, 0, 0, 1.0], (len(t), 1)))
    done = steadyhand.replay((t, T), "waiter", objectives=[Effort()], weights={"effort": 0.1}, robot=robot)
    assert done.steps.shares["effort"].max() > 0 and (done.steps.status == "solved").all()


def test_what_it_raises_reaches_the_caller_and_the_planner_goes_on(robot):
    broken = [False]

    def value(node):
        if broken[0]:
            raise ZeroDivisionError("no such thing")
        return 0.0

    planner, T = steadyhand.Planner(robot, objectives=[Given(value)], weights={"given": 1.0}), robot.fk(robot.home)
    first = planner.update(T, 0.0)
    broken[0] = True
    with pytest.raises(ZeroDivisionError, match="no such thing"):
        planner.update(T, 0.05)
    broken[0] = False
    again = planner.update(T, 0.1)
    assert (first.status, again.status) == ("solved", "solved")


@pytest.mark.parametrize(
    "answers, kind, said",
    [
        ((float("nan"),), ValueError, "objective 'given': value is nan; it must be finite"),
        (("much",), TypeError, "objective 'given': value must be a number, not 'much'"),
        ((0.0, np.zeros(6)), ValueError, "objective 'given': gradient has shape (6,); expected (18,), by [q; dq; ddq]"),
        ((0.0, np.full(18, np.inf)), ValueError, "objective 'given': gradient has numbers that are not finite"),
    ],
)
def test_bad_answers(robot, answers, kind, said):
    planner = steadyhand.Planner(robot, objectives=[Given(*answers)], weights={"given": 1.0})
    with pytest.raises(kind) as refused:
        planner.update(robot.fk(robot.home), 0.0)
    assert said in str(refused.value)


class ByHand(steadyhand.Objective):
    """Answers what the test hands it, for each of its methods."""

    name = "by_hand"

    def __init__(self, value=None, gradient=None):
        self.answers = value, gradient

    def value(self, node, weight):
        return weight[0] * node.q[1] ** 2 if self.answers[0] is None else self.answers[0]


class WithGradient(ByHand):
    def gradient(self, node, weight):
        return self.answers[1]


@pytest.mark.parametrize(
    "term, kind, said",
    [
        (ByHand(np.zeros(3)), TypeError, "value must be a number, not ndarray"),
        (ByHand("much"), TypeError, "value must be a number, not 'much'"),
        (ByHand([1, 2]), TypeError, "value must be a number, not list"),
        (WithGradient(None, np.zeros((18, 1))), ValueError, "gradient has shape (18, 1); expected (18,), by [q; dq; ddq]"),
        (WithGradient(None, np.zeros(6)), ValueError, "gradient has shape (6,); expected (18,), by [q; dq; ddq]"),
        (WithGradient(None, None), TypeError, "gradient must be numbers, not None"),
        (WithGradient(None, ["a"] * 18), TypeError, "gradient must be numbers, not list"),
    ],
)
@pytest.mark.parametrize("asked", ["gradient", "hessian"])
def test_differences_of_bad_answers_are_told_as_those(robot, term, kind, said, asked):
    bound = steadyhand._objective._Bound(term, robot)
    with pytest.raises(kind) as refused:
        getattr(bound, asked)(robot.home, 0 * robot.home, 0 * robot.home, np.eye(4), np.ones(1))
    assert f"objective 'by_hand': {said}" in str(refused.value)


def test_derivatives_are_checked(robot):
    class Half(Effort):
        def gradient(self, node, weight):
            return super().gradient(node, weight) / 2

    class Mixed(Effort):
        def hessian(self, node, weight):
            return np.diag(np.concatenate([0 * node.q, 2 * weight, 2 * weight]))

    for good in (Effort(), Nearness(), ByHand()):
        good.check_derivatives(robot)
    Effort().check_derivatives("ur5e", [1, 2, 3, 4, 5, 6])
    with pytest.raises(ValueError, match=r"objective 'effort': gradient\[1[2-7]\] \(by ddq of \w+_joint\) is .*; differences say .*, at q = "):
        Half().check_derivatives(robot)
    with pytest.raises(ValueError, match=r"objective 'effort': hessian\[(\d+), \1\] \(by dq of (\w+), dq of \2\) is 2; differences say 0"):
        Mixed().check_derivatives(robot)
    Mixed().check_derivatives(robot, hessian=False)
    with pytest.raises(ValueError, match=r"weight has shape \(2,\); expected \(6,\)"):
        Effort().check_derivatives(robot, [1, 2])


def test_a_term_may_not_use_its_planner(robot):
    planner = steadyhand.Planner(robot, objectives=[Given(lambda node: planner.update(np.eye(4), 0.0).dt)], weights={"given": 1.0})
    with pytest.raises(steadyhand.SteadyhandError, match="another thread is using this object"):
        planner.update(robot.fk(robot.home), 0.0)


@pytest.mark.parametrize(
    "members, kind, said",
    [
        ({"name": "Not a word"}, ValueError, "Not a word"),
        ({"name": "lateral"}, ValueError, "lateral"),
        ({"name": ""}, ValueError, "name"),
        ({"acts_on": "nodes"}, ValueError, "acts on 'nodes'; it must be 'intervals' or 'states'"),
        ({"name": 5}, TypeError, "name of the objective Other must be text, not 5"),
        ({"unit": None}, TypeError, "unit of the objective Other must be text, not None"),
        ({"weight_count": 9}, ValueError, "has a weight_count of 9; it must be from 0 to 8"),
    ],
)
def test_bad_terms(robot, members, kind, said):
    with pytest.raises(kind) as refused:
        steadyhand.Planner(robot, objectives=[type("Other", (Given,), members)()])
    assert said in str(refused.value)


def test_what_is_no_term(robot):
    with pytest.raises(TypeError, match="objectives must be instances of steadyhand.Objective, not int"):
        steadyhand.Planner(robot, objectives=[5])
    with pytest.raises(NotImplementedError, match=r"N has no value\(node, weight\)"):
        steadyhand.Planner(robot, objectives=[type("N", (steadyhand.Objective,), {"name": "n"})()]).update(np.eye(4), 0.0)
