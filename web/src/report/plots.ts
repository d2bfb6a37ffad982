import { made } from '../element';
import uPlot from 'uplot';
import { colorOf, resolved } from '../profiles';
import { atLeast, type Charts, columns, format, including, lineMark, logRange, overlay, type Curve, type Series } from './charts';
import type { ByAxis, PlanCurve, Report, Result, ToolCurve } from './data';

/** Dashes of the second and further results of one profile (with another scale, for example), which have its colour. */
const DASHES: (number[] | undefined)[] = [undefined, [7, 3], [2, 3], [9, 3, 2, 3]];
const DOTTED = [1, 3];
const LIMIT = 'var(--limit)', MUTED = 'var(--muted)', CONTACT = lineMark(0, 'contact', LIMIT);

export const profileColor = ({ profiles }: Report, i: number): string => colorOf({ name: profiles[i]!.name, index: i, label: '', weights: [] });
export const profileDash = ({ profiles }: Report, i: number): number[] | undefined => DASHES[profiles.slice(0, i).filter(({ name }) => name === profiles[i]!.name).length % DASHES.length];

const chartFigure = (name: string): HTMLElement => document.querySelector<HTMLElement>(`[data-chart="${name}"]`)!;

/** A tick at the bottom, in the profile's colour, for each step that failed. */
const failureMarks = (report: Report, charts: Charts): uPlot.Plugin => overlay(({ ctx, bbox, valToPos }) => {
  const size = 7 * uPlot.pxRatio;
  report.profiles.forEach(({ failures }, i) => {
    if (!charts.isShown(i)) return;
    ctx.fillStyle = resolved(profileColor(report, i));
    const bottom = bbox.top + bbox.height - i * size;
    for (const t of failures) ctx.fillRect(Math.round(valToPos(t, 'x', true)) - uPlot.pxRatio, bottom - size + 1, 2 * uPlot.pxRatio, size - 1);
  });
});

/**
 * The terms stacked, the sum first: each area is drawn over the last one, so the visible part of an area is its share.
 */
export function stacked({ t, shares }: Pick<Result, 't' | 'shares'>, relative: boolean): uPlot.AlignedData {
  const total = t.map((_, k) => shares.reduce((sum, share) => sum + share[k]!, 0)), sums = t.map(() => 0);
  const layers = shares.map((share) => share.map((value, k) => (sums[k]! += relative ? (total[k]! > 0 ? (100 * value) / total[k]! : 0) : value)));
  return columns(layers.reverse().map((values) => ({ t, values })));
}

/**
 * From 0 to a limit for all but a few of the values that are not near zero: a spike must not hide the others. `say`
 * gets a text about what is cut off, or an empty one.
 */
function withoutSpikes(values: ArrayLike<number | null | undefined>, max: number, say: (words: string) => void): [number, number] {
  const known = Array.from(values).filter((value): value is number => typeof value === 'number' && value > 1e-6 * max).sort((a, b) => a - b), usual = known[Math.floor(0.98 * (known.length - 1))] ?? 0;
  const cut = usual > 0 && max > 5 * usual;
  say(cut ? `Cut off above: peaks of up to ${format(max)}.` : '');
  return [0, cut ? 2 * usual : 1.05 * max || 1];
}

/** All plots of the plans; those of a session's measurements are elsewhere. */
export function showPlots(report: Report, charts: Charts): void {
  const { profiles, targets, session } = report, period = 1e3 / report.rate_hz;
  /** The same curve of the other tools, dotted. */
  const ofOthers = (name: PlanCurve): { curve: Curve; series: Series }[] => profiles.flatMap(({ t, label, other_tools: tools = [] }, i) => tools.flatMap((tool) => (
    name in tool ? [{ curve: { t, values: tool[name as ToolCurve] }, series: { label: `${label}, ${tool.name}`, color: profileColor(report, i), dash: DOTTED, profile: i } }] : [])));
  /** One line per profile, after the lines of `before`; of a robot with several tools one for each. */
  const perProfile = (name: PlanCurve, options: Partial<Parameters<Charts['add']>[0]>, before: readonly (Curve & { label: string })[] = [], more: { curve: Curve; series: Series }[] = []): void => charts.add({
    figure: chartFigure(name),
    columns: () => columns([...before, ...profiles.map((profile) => ({ t: profile.t, values: profile[name] })), ...ofOthers(name).map(({ curve }) => curve), ...more.map(({ curve }) => curve)]),
    series: [
      ...before.map(({ label }): Series => ({ label, color: MUTED, dash: [6, 4], width: 1.4 })),
      ...profiles.map(({ label, other_tools: tools = [] }, i): Series => ({ label: report.tools && tools.length > 0 && name in tools[0]! ? `${label}, ${report.tools[0]}` : label, color: profileColor(report, i), dash: profileDash(report, i), profile: i })),
      ...[...ofOthers(name), ...more].map(({ series }) => series),
    ],
    ...options,
  });
  const byAxis = (name: keyof ByAxis, unit: string, span: number): void => perProfile(name, { unit, range: atLeast(span) }, targets.map((target) => ({ label: target.label, t: target.t, values: target[name] })));
  for (const axis of ['x', 'y', 'z'] as const) byAxis(axis, 'm', 0.01);
  for (const angle of ['roll', 'pitch', 'yaw'] as const) byAxis(angle, '°', 0.1);
  perProfile('lateral', { unit: 'm/s²', range: including(0) });
  perProfile('vertical', { unit: 'm/s²', plugins: [lineMark(9.81, 'at rest', MUTED)], range: including(9.81) });
  perProfile('position_error', { unit: 'mm', range: including(0) });
  perProfile('orientation_error', { unit: '°', range: including(0) });
  perProfile('solve_time', { unit: 'ms', log: true, plugins: [lineMark(period, 'next plan is due', LIMIT), failureMarks(report, charts)], range: logRange(period) });
  perProfile('iterations', { range: including(0) });
  perProfile('distance', { unit: 'mm', plugins: [CONTACT], range: including(0) }, [], profiles.flatMap(({ t, label, distance_between_arms: values }, i) => (
    values ? [{ curve: { t, values }, series: { label: `${label}, between the arms`, color: profileColor(report, i), dash: DOTTED, profile: i } }] : [])));
  charts.add({
    figure: chartFigure('tail'),
    columns: () => uPlot.join(profiles.map(({ tail }) => [tail.ms, tail.percent] as uPlot.AlignedData)),
    series: profiles.map(({ label }, i) => ({ label, color: profileColor(report, i), profile: i })),
    unit: '%', log: true, range: logRange(100),
    x: { label: 'solve time, ms (log)', name: 'solve time', range: logRange(), value: (value) => format(value, 'ms') },
  });
  const latency = session?.latency;
  chartFigure('latency').hidden = !latency || latency.t.length < 2;
  if (latency && latency.t.length > 1) {
    charts.add({
      figure: chartFigure('latency'),
      columns: () => columns([{ t: latency.t, values: latency.p50 }, { t: latency.t, values: latency.p99 }]),
      series: [{ label: 'median so far', color: 'var(--ink)' }, { label: 'p99 so far', color: MUTED, dash: [4, 3] }],
      unit: 'ms', range: including(0),
    });
  }
  profiles.forEach((profile, i) => showProfile(report, charts, profile, i));
  document.getElementById('around')!.hidden = profiles.every(({ objects }) => objects.length === 0);
}

/** Terms, objects and joints, in separate figures for each profile. */
function showProfile(report: Report, charts: Charts, profile: Result, i: number): void {
  const figure = (parent: string, ...more: HTMLElement[]): HTMLElement => {
    const swatch = made('span', { className: 'swatch' }), of = made('figure', {}, made('figcaption', {}, made('h3', {}, swatch, profile.label)), ...more);
    swatch.style.setProperty('--color', profileColor(report, i));
    of.dataset.ofProfile = String(i);
    document.querySelector(`[data-per-profile="${parent}"]`)!.append(of);
    return of;
  };
  const note = made('p', { className: 'lead cut' }), terms = profile.terms.length, ofTerm = (term: number): string => `var(--term-${(term % 8) + 1})`;
  charts.add({
    figure: figure('objective', note),
    columns: () => stacked(profile, isRelative()),
    gridOnTop: true,
    range: (u, _min, max) => {
      const [from, to] = u.series[0]!.idxs ?? [0, u.data[0].length - 1];
      return isRelative() ? [0, 100] : withoutSpikes(u.data[1]!.slice(from, to + 1), max, (words) => { note.textContent = words; });
    },
    series: profile.terms.map((label, term): Series => ({
      label, title: profile.term_names[term], color: ofTerm(term), fill: ofTerm(term), width: 0.5,
      value: (u, _value, _series, k) => {
        if (k === null) return '–';
        const below = term === 0 ? 0 : u.data[terms - term + 1]![k]!;
        return format(u.data[terms - term]![k]! - below, isRelative() ? '%' : '');
      },
    })).reverse(),
  });
  if (profile.objects.length > 0) {
    charts.add({
      figure: figure('objects'), columns: () => [profile.t, ...profile.object_distances] as uPlot.AlignedData, unit: 'mm', plugins: [CONTACT], range: including(0),
      series: profile.objects.map((label, object) => ({ label, color: ofTerm(object), width: 1.3 })),
    });
  }
  charts.add({
    figure: figure('speeds'),
    columns: () => columns(profile.speeds.percent.map((values) => ({ t: profile.speeds.t, values }))),
    unit: '%', plugins: [lineMark(100, 'limit', LIMIT)], range: (_u, _min, max) => [0, Math.max(108, 1.05 * max)],
    series: profile.joints.map((label, joint) => ({ label, title: profile.joint_names[joint], color: `var(--joint-${(joint % 8) + 1})`, width: 1.3 })),
  });
}

/** The shares of the objective are shown in %. */
const isRelative = (): boolean => document.getElementById('relative')!.getAttribute('aria-pressed') === 'true';
