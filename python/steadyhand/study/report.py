"""The report of a study: one HTML file with its plots inside. The same trials give the same bytes."""

from __future__ import annotations

import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._files import write_whole
from . import statistics as st
from .analysis import ALL_TASKS, Analysed, Results
from .measures import MEASURES
from .order import rows_of
from .trial import ONE_INSTANT_IK

PLOTTED = ("completion_time", "throughput", "spilled_share", "tracking_error", "tlx_raw", "sus")
COLORS = ("#2f6fb0", "#c2571a", "#2a8f6d", "#8a4fa3", "#a08a1e", "#b23a5e")
STYLE = """
body{font:16px/1.5 system-ui,sans-serif;color:#1d2530;max-width:62rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.9rem;line-height:1.2}h2{margin-top:2.4rem;border-bottom:1px solid #d5dbe2}h3{margin:1.6rem 0 .4rem}
table{border-collapse:collapse;margin:.6rem 0;font-size:.92rem}td,th{padding:.18rem .7rem .18rem 0;text-align:right;white-space:nowrap}
td:first-child,th:first-child{text-align:left}th{border-bottom:1px solid #9aa6b4;font-weight:600;white-space:normal;vertical-align:bottom}
.plots{display:flex;flex-wrap:wrap;gap:.5rem}.plots svg{flex:0 1 29rem}
svg{max-width:100%;height:auto}.note{color:#55616f;font-size:.92rem}.best{font-weight:700}blockquote{margin:0;padding:.2rem 1rem;border-left:3px solid #9aa6b4}
details{margin:.4rem 0}
"""


def number(value: float, digits: int = 3) -> str:
    if not np.isfinite(value):
        return "–"
    if value != 0.0 and abs(value) < 1e-4:
        return f"{value:.1e}"
    return f"{value:.{digits}g}" if abs(value) < 1000 else f"{value:.0f}"


def interval(estimate: st.Estimate) -> str:
    if not np.isfinite(estimate.low):
        return number(estimate.value)
    return f"{number(estimate.value)} [{number(estimate.low)}, {number(estimate.high)}]"


def p_value(p: float) -> str:
    return "&lt; 0.001" if p < 0.001 else f"{p:.3f}"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = "".join(f"<th>{each}</th>" for each in head)
    body = "".join("<tr>" + "".join(f"<td>{each}</td>" for each in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>\n"


def _figure(width: float, height: float) -> tuple[Any, Any]:
    import matplotlib

    matplotlib.use("agg")
    matplotlib.rcParams.update({"svg.hashsalt": "steadyhand", "svg.fonttype": "none", "font.size": 10, "axes.spines.top": False,
                                "axes.spines.right": False, "font.family": "sans-serif"})  # fmt: skip
    from matplotlib import pyplot

    return pyplot.subplots(figsize=(width, height), layout="constrained")


def _svg(figure: Any) -> str:
    from matplotlib import pyplot

    out = io.StringIO()
    figure.savefig(out, format="svg", metadata={"Date": None})
    pyplot.close(figure)
    text = out.getvalue()
    return text[text.index("<svg") :]


def _axis(each: Analysed) -> str:
    return each.measure.label + (f", {each.measure.unit}" if each.measure.unit else "")


def plot_conditions(each: Analysed, names: Sequence[str]) -> str:
    """Participants as dots, means with their intervals."""
    figure, axes = _figure(max(3.0, 1.2 + 0.8 * len(names)), 3.4)
    values = np.exp(each.values) if each.measure.logarithmic else each.values
    rng = np.random.default_rng(0)
    for j in range(len(names)):
        column = values[np.isfinite(values[:, j]), j]
        axes.plot(j + rng.uniform(-0.14, 0.14, len(column)), column, "o", ms=3.5, mew=0, alpha=0.35, color=COLORS[0])
        mean = each.means[j]
        if np.isfinite(mean.low):
            axes.plot([j, j], [mean.low, mean.high], lw=2.2, color="#1d2530", solid_capstyle="butt")
        axes.plot(j, mean.value, "o", ms=7, mew=1.5, mec="#1d2530", mfc="white")
    axes.set_xticks(range(len(names)), names, rotation=20 if len(names) > 4 else 0, ha="right" if len(names) > 4 else "center")
    axes.set_xlim(-0.6, len(names) - 0.4)
    axes.set_ylabel(_axis(each))
    if np.nanmin(values) >= 0.0:
        axes.set_ylim(bottom=0.0)
    return _svg(figure)


def plot_factors(each: Analysed, results: Results, along: str, lines: Sequence[str]) -> str:
    """Plot of two factors: one along the axis, a line for each level of the other."""
    figure, axes = _figure(6.2, 3.6)
    levels = list(dict.fromkeys(dict(c.factors)[along] for c in results.study.conditions))
    for n, line in enumerate(lines):
        found = [(levels.index(dict(c.factors)[along]), each.means[j]) for j, c in enumerate(results.study.conditions) if _other(c.factors, along) == line]
        x = np.array([place for place, _ in found]) + 0.06 * (n - (len(lines) - 1) / 2)
        y = np.array([mean for _, mean in found])
        axes.errorbar(x, y[:, 0], [y[:, 0] - y[:, 1], y[:, 2] - y[:, 0]], fmt="o-", ms=5, lw=1.6, capsize=0, color=COLORS[n % len(COLORS)], label=line)
    axes.set_xticks(range(len(levels)), levels)
    axes.set_xlabel(along + " added on purpose" if along == "latency" else along)
    axes.set_ylabel(_axis(each))
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.legend(frameon=False)
    return _svg(figure)


def _other(factors: Sequence[tuple[str, str]], along: str) -> str:
    return ", ".join(level for name, level in factors if name != along)


def _along(results: Results) -> str | None:
    """The factor that is drawn along the axis: latency, else the last."""
    if len(results.study.factors) < 2:
        return None
    return "latency" if "latency" in results.study.factors else results.study.factors[-1]


def best_by_level(results: Results, along: str) -> str:
    """At each level of a factor, which of the others' combinations is best, and by how much it is ahead of the next."""
    text = ""
    for each in results.analysed:
        if each.measure.name not in ("completion_time", "throughput", "spilled_share"):
            continue
        rows = []
        for level in dict.fromkeys(dict(c.factors)[along] for c in results.study.conditions):
            at = [j for j, c in enumerate(results.study.conditions) if dict(c.factors)[along] == level and np.isfinite(each.means[j].value)]
            if len(at) < 2:
                continue
            at.sort(key=lambda j: -each.measure.better * each.means[j].value)
            pair = st.pairs(each.values, [c.name for c in results.study.conditions], [(at[0], at[1])])[0]
            sure = not pair.difference.low <= (0.0) <= pair.difference.high
            rows.append([
                level, html.escape(_other(results.study.conditions[at[0]].factors, along)) if sure else "none is clearly", interval(each.means[at[0]]),
                html.escape(_other(results.study.conditions[at[1]].factors, along)), interval(each.means[at[1]]), interval(each.shown(pair.difference)),
            ])  # fmt: skip
        if rows:
            kind = "ratio" if each.measure.logarithmic else "difference"
            text += f"<h3>{html.escape(each.task)}: {_axis(each)}</h3>\n"
            text += table([along, "best", "lowest mean" if each.measure.better < 0 else "highest mean", "next", "its mean", f"{kind} to the next"], rows)
    return text


def _means(results: Results, task: str) -> str:
    found = [each for each in results.analysed if each.task == task]
    rows = []
    whole = all(n == len(results.participants) for each in found for n in each.counts)
    for j, condition in enumerate(results.study.conditions):
        row = [html.escape(condition.name)]
        for each in found:
            values = [m.value for m in each.means if np.isfinite(m.value)]
            best = max(values, key=lambda v: each.measure.better * v)
            text = interval(each.means[j]) + ("" if whole else f" (n = {each.counts[j]})")
            row.append(f'<span class="best">{text}</span>' if each.means[j].value == best and len(set(values)) > 1 else text)
        rows.append(row)
    text = ""
    for first in range(0, len(found), 4):
        head = ["condition"] + [_axis(each) for each in found[first : first + 4]]
        text += table(head, [[row[0], *row[1 + first : 5 + first]] for row in rows])
    return text


def _tests(each: Analysed) -> str:
    kind = "ratio" if each.measure.logarithmic else "difference"
    text = ""
    if each.model:
        text += table(
            ["mixed model", f"{kind} to {html.escape(each.model[0].reference)}", "df", "p"],
            [[html.escape(c.name), interval(each.shown(c.difference)), f"{c.df:.0f}", p_value(c.p)] for c in each.model],
        )
    if each.friedman:
        text += f'<p class="note">Friedman: chi² = {number(each.friedman.statistic)}, {each.friedman.df} degrees of freedom, p = {p_value(each.friedman.p)}.</p>\n'
    rows = []
    for pair in each.pairs:
        needed = st.participants_for(pair.dz.value)
        rows.append([html.escape(f"{pair.a} – {pair.b}"), interval(each.shown(pair.difference)), interval(pair.dz), p_value(pair.p_holm),
                     f"{100 * st.power(pair.dz.value, pair.n):.0f} %" if np.isfinite(pair.dz.value) else "–", str(needed) if needed else "–"])  # fmt: skip
    if rows:
        text += table(["pair", kind, "d<sub>z</sub>", "p (Wilcoxon, Holm)", "power at this d<sub>z</sub>", "participants for 80 %"], rows)
    return text


def methods(results: Results) -> str:
    """The text of a methods section."""
    study, simulated = results.study, results.simulated
    who = f"{len(results.participants)} {'simulated operators' if simulated else 'participants'}"
    text = [f"{who} took part in a within-subject experiment with {len(study.conditions)} conditions: " + "; ".join(_describe(c) for c in study.conditions) + "."]
    if simulated:
        text.append(
            "Each simulated operator is an instance of the stochastic optimized-submovement model (Meyer et al., 1988) with submovements of minimum "
            "jerk (Flash & Hogan, 1985), a visual delay drawn from 150 to 250 ms and signal-dependent noise, who sees the glass where it is shown and "
            "is in a closed loop with the planner, in virtual time. Simulated operators neither learn nor tire, and do not take care of the liquid."
        )
    rows = rows_of(len(study.conditions))
    text.append(
        f"The order of conditions was balanced by {'a Latin square' if len(study.conditions) % 2 == 0 else 'a pair of Latin squares'} of {rows} orders "
        "(Williams, 1949)." if study.order == "balanced" and len(study.conditions) > 1 else "The order of conditions was drawn at random for each participant."
        if len(study.conditions) > 1 else "There was one condition."
    )
    tasks = []
    for task in study.tasks:
        if task.kind == "targets":
            both = " with both hands at once, each with its own circle, and the next targets shown once both were reached" if len(task.tools) > 1 else ""
            tasks.append(f"{task.name}: {task.count} targets of {1e3 * task.width:.0f} mm on a circle of {1e3 * task.distance:.0f} mm, reached across it in turn{both} "
                         f"(ISO 9241-411); a target was reached once the glass had stayed in it for {task.dwell:g} s, which the movement time leaves out")  # fmt: skip
        elif task.kind == "gates":
            tasks.append(f"{task.name}: the glass was moved through {len(task.gates)} gates with a radius of {1e3 * task.radius:.0f} mm")
        else:
            tasks.append(f"{task.name}: the glass was carried to {len(task.places)} places in turn and held within {1e3 * task.radius:.0f} mm of each for "
                         f"{task.holding:g} s")  # fmt: skip
    text.append("The tasks were " + "; ".join(tasks) + ".")
    text.append(f"In each condition every task was done {study.repetitions} times for the record"
                + ("." if simulated else f", after {study.training} in training, with rests of {study.rest:g} s between conditions."))  # fmt: skip
    if any(c.latency for c in study.conditions):
        text.append("Latency was added on purpose on the path named (command: between the check of the hand's poses and the planner; display: between the "
                    "arm and its picture).")  # fmt: skip
    text.append(
        "Throughput is the effective index of difficulty over the movement time (ISO 9241-411, annex B). Smoothness is the spectral arc length of the "
        "glass's speed (Balasubramanian et al., 2015). The mean over a participant's trials in a condition was analysed, for times, lengths and errors "
        "of logarithms, by a linear mixed model with condition and period as fixed and participant as random effect (REML; Student's t with between-within "
        "degrees of freedom), and by Friedman's test with Wilcoxon signed-rank tests of all pairs, corrected by Holm (1979). Effect sizes are Cohen's "
        "d<sub>z</sub>, their 95 % intervals by the noncentral t distribution."
    )
    if any(each.task == ALL_TASKS for each in results.analysed):
        text.append("For all tasks together, the mean of a participant's values of the tasks was analysed in the same way.")
    if results.missing > 0:
        text.append(f"{results.missing} trials of the schedule were not done.")
    return "<blockquote><p>" + " ".join(text) + "</p></blockquote>\n"


def _describe(c: Any) -> str:
    profile = "differential inverse kinematics" if c.profile == ONE_INSTANT_IK else f"profile {html.escape(c.profile)}"
    latency = f", {1e3 * c.latency:.0f} ms of latency added on {'both paths' if c.path == 'both' else f'the {c.path} path'}" if c.latency else ""
    return f"{html.escape(c.name)} ({profile}, scale {c.scale:g}{latency})"


def render(results: Results) -> str:
    study, simulated, n = results.study, results.simulated, len(results.participants)
    names = [c.name for c in study.conditions]
    along = _along(results)
    body = f"<h1>{html.escape(study.title)}</h1>\n"
    body += f"<p>{n} {'simulated ' if simulated else ''}participants, {len(names)} conditions, {len(study.tasks)} task{'s' * (len(study.tasks) > 1)}; seed {study.seed}. "
    body += "Brackets and bars: 95 % intervals. Bold: the best mean. "
    body += f"With so many participants, an effect of d<sub>z</sub> = {number(st.detectable(n))} is found with 80 % power.</p>\n"
    if results.missing > 0:
        body += f'<p class="note">Not finished: {results.missing} trials of the schedule are not there. n: from how many participants a mean is.</p>\n'
    if simulated:
        body += '<p class="note">All operators are simulated. The results must be confirmed with people.</p>\n'
    if along:
        body += f"<h2>Best at each {along}</h2>\n<p class=note>Named where the interval of the difference to the next leaves out 0 (not corrected for "
        body += "how many there are; the tables below are).</p>\n" + best_by_level(results, along)
    for task in dict.fromkeys(each.task for each in results.analysed):
        body += f"<h2>{html.escape(task)}</h2>\n{_means(results, task)}"
        found = [each for each in results.analysed if each.task == task]
        lines = list(dict.fromkeys(_other(c.factors, along) for c in study.conditions)) if along else []
        plots = [plot_factors(e, results, along, lines) if along else plot_conditions(e, names) for e in found if e.measure.name in PLOTTED]
        body += f'<div class="plots">{"".join(plots)}</div>\n'
        for each in found:
            if len(names) > 1:
                body += f"<details><summary>{html.escape(each.measure.label)}: tests</summary>\n{_tests(each)}</details>\n"
    if results.fitts:
        body += "<h2>Fitts's law</h2>\n"
        rows = [[html.escape(name), f"{len(line.ids)}", f"{1e3 * line.intercept:.0f} ms + {1e3 * line.slope:.0f} ms/bit × ID", f"{line.r2:.3f}"]
                for name, line in results.fitts.items()]  # fmt: skip
        body += table(["condition", "indices of difficulty", "movement time", "r²"], rows)
    body += "<h2>Methods</h2>\n<p class=note>For a paper; adapt what your laboratory did differently.</p>\n" + methods(results)
    body += "<h2>Measures</h2>\n" + table(["measure", "unit", "better"], [[m.label, m.unit, "more" if m.better > 0 else "less"] for m in MEASURES])
    return (f'<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{html.escape(study.title)}'
            f"</title><style>{STYLE}</style></head><body>\n{body}</body></html>\n")  # fmt: skip


def write_report(results: Results, out: Path) -> Path:
    path = Path(out) / "report.html"
    write_whole(path, render(results).encode())
    return path
