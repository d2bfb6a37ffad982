'use strict';

const data = JSON.parse(document.getElementById('data').textContent);
const profiles = data.profiles;
const shownProfiles = profiles.map(() => true);
const root = document.documentElement;

// ---------------------------------------------------------------------------------------------- colours

// Custom properties hold light-dark(); an element's computed colour is what a canvas understands.
const probe = document.body.appendChild(document.createElement('i'));
probe.hidden = true;
function color(name) {
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}
const profileVariable = (i) => (/^[\w-]+$/.test(profiles[i].name) ? `profile-${profiles[i].name}, var(--profile-other-${(i % 3) + 1})` : `profile-other-${(i % 3) + 1}`);
const profileColor = (i) => color(profileVariable(i));
/** The second result of the same profile, with another scale say, has its colour and is dashed; and so on. */
const DASHES = [undefined, [7, 3], [2, 3], [9, 3, 2, 3]];
const profileDash = (i) => DASHES[profiles.slice(0, i).filter(({ name }) => name === profiles[i].name).length % DASHES.length];

// ---------------------------------------------------------------------------------------------- numbers

function format(value, unit, digits = 3) {
  if (value == null) return '–';
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(Math.max(Math.abs(value), 10 ** (1 - digits)))));
  return value.toFixed(Math.min(decimals, digits)) + (unit ? `\u00a0${unit}` : '');
}
/** m:ss.ss, as the operator's page has times. */
const seconds = (value) => {
  if (value == null) return '–';
  const hundredths = Math.round(100 * Math.max(0, value));
  return `${Math.floor(hundredths / 6000)}:${((hundredths % 6000) / 100).toFixed(2).padStart(5, '0')}`;
};

/** m:ss of an axis, with as many decimals as its steps need. */
function clock(ticks) {
  const step = ticks.length > 1 ? ticks[1] - ticks[0] : 1, decimals = Math.min(3, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return ticks.map((tick) => {
    const units = Math.round(tick * 10 ** decimals), minute = 60 * 10 ** decimals, rest = ((units % minute) / 10 ** decimals).toFixed(decimals);
    return units < 0 ? '' : `${Math.floor(units / minute)}:${rest.padStart(decimals > 0 ? decimals + 3 : 2, '0')}`;
  });
}

/** s between the ticks of an axis of time: steps that m:ss makes round. */
const TIME_STEPS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1200, 1800, 3600];

/**
 * Joins curves [{t, values}] with times of their own into the columns of one plot: undefined where a curve has no value
 * at another's time, which the line passes over; null stays and breaks it.
 */
function columns(curves) {
  const tables = curves.map(({ t, values }) => broken(t, values));
  return uPlot.join(tables, tables.map((table) => table.map(() => EXPAND_NULLS)));
}

/** uPlot's word for a null that holds at the other curves' times around it, too. */
const EXPAND_NULLS = 2;

/** With a null where nothing was planned for a while, so that no line joins what is before and after. */
function broken(t, values) {
  const steps = t.slice(1).map((at, k) => at - t[k]).sort((a, b) => a - b);
  const gap = Math.max(0.5, 5 * (steps[steps.length >> 1] ?? 0));
  const times = [], kept = [];
  t.forEach((at, k) => {
    if (k > 0 && at - t[k - 1] > gap) {
      times.push((at + t[k - 1]) / 2);
      kept.push(null);
    }
    times.push(at);
    kept.push(values[k]);
  });
  return [times, kept];
}

// ---------------------------------------------------------------------------------------------- charts

/** Draws horizontal lines {at, text, color} with their names. */
function lineMarks(lines) {
  return {
    hooks: {
      draw: (u) => {
        const { ctx } = u;
        const ratio = uPlot.pxRatio;
        ctx.save();
        ctx.font = `${11 * ratio}px system-ui, sans-serif`;
        ctx.textAlign = 'right';
        for (const line of lines) {
          const y = Math.round(u.valToPos(line.at, 'y', true));
          if (y < u.bbox.top - 1 || y > u.bbox.top + u.bbox.height + 1) continue;
          ctx.strokeStyle = ctx.fillStyle = color(line.color);
          ctx.lineWidth = ratio;
          ctx.setLineDash([5 * ratio, 4 * ratio]);
          ctx.beginPath();
          ctx.moveTo(u.bbox.left, y);
          ctx.lineTo(u.bbox.left + u.bbox.width, y);
          ctx.stroke();
          const above = y - u.bbox.top > 16 * ratio;
          const place = [line.text, u.bbox.left + u.bbox.width - 4 * ratio, y + (above ? -4 : 13) * ratio];
          ctx.setLineDash([]);
          ctx.strokeStyle = color('panel');
          ctx.lineWidth = 4 * ratio;
          ctx.strokeText(...place);
          ctx.fillText(...place);
        }
        ctx.restore();
      },
    },
  };
}

/** A plugin that paints over a plot, and no further. @param paint of uPlot */
const overlay = (paint) => ({
  hooks: {
    draw: (u) => {
      const { ctx, bbox } = u;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      paint(u);
      ctx.restore();
    },
  },
});

/** Draws a tick at the bottom, in its profile's colour, for every step that failed. */
const failureMarks = overlay(({ ctx, bbox, valToPos }) => {
  const size = 7 * uPlot.pxRatio;
  profiles.forEach((profile, i) => {
    if (!shownProfiles[i]) return;
    ctx.fillStyle = profileColor(i);
    const bottom = bbox.top + bbox.height - i * size;
    for (const t of profile.failures) {
      ctx.fillRect(Math.round(valToPos(t, 'x', true)) - uPlot.pxRatio, bottom - size + 1, 2 * uPlot.pxRatio, size - 1);
    }
  });
});

const charts = [];

/**
 * What a chart needs: `figure` to stand in, `columns` [x, y...], `series` [{label, title?, color(), profile?, dash?, fill?,
 * value?}], and optionally `unit`, `plugins`, `range` (of y), `log` (y), `downwards` (y), `x` {label, value, log}: without `x` it shares
 * time, cursor and zoom with the others.
 */
function addChart(spec) {
  const chart = { spec, plot: null };
  charts.push(chart);
  build(chart);
  spec.figure.setAttribute('role', 'group');
  spec.figure.setAttribute('aria-label', `Plot: ${spec.figure.querySelector('h3').textContent}`);
  new ResizeObserver(() => requestAnimationFrame(() => resize(chart))).observe(spec.figure);
  return chart;
}

function inner(figure) {
  const style = getComputedStyle(figure);
  return Math.floor(figure.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight));
}
const height = (width) => (width < 420 ? 190 : 230);

function resize({ spec, plot }) {
  const width = inner(spec.figure);
  if (width > 0 && width !== plot.width) plot.setSize({ width, height: height(width) });
}

function build(chart) {
  const { spec } = chart;
  const range = chart.plot && [chart.plot.scales.x.min, chart.plot.scales.x.max];
  const hidden = chart.plot ? chart.plot.series.map((series) => !series.show) : [];
  chart.plot?.destroy();

  const axis = {
    stroke: color('muted'),
    font: '11px system-ui, sans-serif',
    labelFont: '11px system-ui, sans-serif',
    grid: { stroke: color('grid'), width: 1 },
    ticks: { stroke: color('grid'), width: 1, size: 4 },
  };
  const time = !spec.x;
  const width = inner(spec.figure);
  const logAxis = { values: (u, ticks) => ticks.map(plain), filter: (u, ticks) => ticks.map(oneTwoFive) };
  const scale = (log, scaleRange) => ({ ...(log && { distr: 3 }), ...(scaleRange && { range: scaleRange }) });
  chart.plot = new uPlot(
    {
      width,
      height: height(width),
      padding: [8, 10, 0, 0],
      drawOrder: spec.gridOnTop ? ['series', 'axes'] : ['axes', 'series'],
      cursor: {
        y: false,
        points: { size: 7 },
        drag: { x: true, y: false },
        ...(time && { sync: { key: 'time' }, hover: { prox: nearby } }),
      },
      scales: { x: { time: false, ...scale(spec.x?.log, spec.x?.range ?? (time ? wholeSession : undefined)) }, y: { ...scale(spec.log, spec.range), dir: spec.downwards ? -1 : 1 } },
      axes: [
        { ...axis, label: spec.x?.label ?? 'time, m:ss', labelSize: 16, labelGap: 0, size: 26, space: 60, ...(spec.x?.log && logAxis), ...(time && { incrs: TIME_STEPS, values: (u, ticks) => clock(ticks) }) },
        { ...axis, size: 46, space: 34, ...(spec.log && logAxis) },
      ],
      series: [
        { label: spec.x?.name ?? 'time', value: (u, value) => (spec.x?.value ?? seconds)(value) },
        ...spec.series.map((series, i) => ({
          label: series.label,
          stroke: series.color(),
          width: series.width ?? 1.6,
          dash: series.dash,
          fill: series.fill?.(),
          show: !hidden[i + 1] && isShown(series.profile),
          points: { show: false },
          value: series.value ?? ((u, value) => format(value, spec.unit)),
        })),
      ],
      plugins: spec.plugins ?? [],
      hooks: time ? { ready: [tellPointer] } : {},
      legend: { markers: { width: 0, fill: (u, i) => legendColor(spec.series[i - 1]) } },
    },
    chart.columns?.() ?? spec.columns,
    spec.figure,
  );
  // What a series is called in files, for who looks it up.
  chart.plot.root.querySelectorAll('.u-series').forEach((row, i) => { row.title = spec.series[i - 1]?.title ?? ''; });
  if (range && range[0] != null) chart.plot.setScale('x', { min: range[0], max: range[1] });
}

/** What else shows a time follows the pointer through a plot; null: it has left. */
function tellPointer({ over, posToVal }) {
  const tell = (detail) => document.dispatchEvent(new CustomEvent('point', { detail }));
  over.addEventListener('mousemove', ({ offsetX }) => tell(posToVal(offsetX, 'x')));
  over.addEventListener('mouseleave', () => tell(null));
}

/** px from the pointer to what is told as there: of a profile that led before or after, nothing is. */
const nearby = (u, series, k, t) => Math.max(12, u.valToPos(t + 0.5, 'x') - u.valToPos(t, 'x'));

/** All plots of a session's times have its begin and end, whatever part of it they have values of. */
const wholeSession = (u, min, max) => {
  const { story } = data, [first, last] = [u.data[0][0], u.data[0].at(-1)];
  return story && min === first && max === last ? [Math.min(first, story.begin), Math.max(last, story.end)] : [min, max];
};

const legendColor = (series) => (series ? series.fill?.() ?? series.color() : 'transparent');
const plain = (tick) => (tick == null ? '' : String(Number(tick.toPrecision(2))));
const oneTwoFive = (tick) => (/^[125]e/.test(Number(tick.toPrecision(6)).toExponential()) ? tick : null);

const isShown = (profile) => profile === undefined || shownProfiles[profile];

/** One line per profile of its step curve `name`, after the lines of `before`. */
function profileChart(name, options = {}) {
  const before = options.before ?? [];
  const figure = document.querySelector(`[data-chart="${name}"]`);
  addChart({
    figure,
    columns: columns([...before, ...profiles.map((p) => ({ t: p.t, values: p[name] }))]),
    series: [
      ...before.map(({ label }) => ({ label, color: () => color('muted'), dash: [6, 4], width: 1.4 })),
      ...profiles.map((p, i) => ({ label: p.label, color: () => profileColor(i), dash: profileDash(i), profile: i })),
    ],
    ...options,
  });
}

/** Room above and below, and `values` inside. */
const including = (...values) => (u, min, max) => {
  const low = Math.min(min, ...values);
  const high = Math.max(max, ...values);
  const room = Math.max(0.06 * (high - low), 1e-3 * Math.max(Math.abs(low), Math.abs(high))) || 1; // what differs by rounding has no ticks
  return [low === 0 ? 0 : low - room, high + room];
};
/** Room above and below, and no less than `span`: what hardly moves has no ticks of its own. */
const atLeast = (span) => (u, min, max) => {
  const room = Math.max(0.56 * (max - min), 0.5 * span), middle = 0.5 * (min + max);
  return [middle - room, middle + room];
};
/** 0.09 of 0.0954: uPlot's logarithmic ticks never end where the axis begins with a number that is not round. */
const roundDown = (value) => {
  const exponent = Math.floor(Math.log10(value));
  return Number(`${Math.floor(value / 10 ** exponent)}e${exponent}`);
};
/** A logarithmic axis has no place for zero, and where nothing is drawn no ends. */
const logRange = (...values) => (u, min, max) => {
  const seen = [min, max, ...values].filter((value) => value > 0 && value < Infinity);
  return seen.length > 0 ? [roundDown(0.8 * Math.min(...seen)), 1.3 * Math.max(...seen)] : [0.1, 1];
};

const targets = (name) => data.targets.map((target) => ({ label: target.label, t: target.t, values: target[name] }));
for (const axis of ['x', 'y', 'z']) profileChart(axis, { before: targets(axis), unit: 'm', range: atLeast(0.01) });
for (const angle of ['roll', 'pitch', 'yaw']) profileChart(angle, { before: targets(angle), unit: '°', range: atLeast(0.1) });
profileChart('lateral', { unit: 'm/s²', range: including(0) });
profileChart('vertical', { unit: 'm/s²', plugins: [lineMarks([{ at: 9.81, text: 'at rest', color: 'muted' }])], range: including(9.81) });
profileChart('position_error', { unit: 'mm', range: including(0) });
profileChart('orientation_error', { unit: '°', range: including(0) });
profileChart('solve_time', {
  unit: 'ms',
  log: true,
  plugins: [lineMarks([{ at: data.period_ms, text: 'next plan is due', color: 'limit' }]), failureMarks],
  range: logRange(data.period_ms),
});
profileChart('iterations', { range: including(0) });
profileChart('distance', { unit: 'mm', plugins: [lineMarks([{ at: 0, text: 'contact', color: 'limit' }])], range: including(0) });

addChart({
  figure: document.querySelector('[data-chart="tail"]'),
  columns: uPlot.join(profiles.map((p) => [p.tail.ms, p.tail.percent])),
  series: profiles.map((p, i) => ({ label: p.label, color: () => profileColor(i), profile: i })),
  unit: '%',
  log: true,
  x: { label: 'solve time, ms (log)', name: 'solve time', log: true, range: logRange(), value: (value) => format(value, 'ms') },
  range: logRange(100),
});

// ---------------------------------------------------------------------------------------------- per profile

function addFigure(parent, i) {
  const figure = document.createElement('figure');
  const caption = figure.appendChild(document.createElement('figcaption'));
  const heading = caption.appendChild(document.createElement('h3'));
  const swatch = heading.appendChild(document.createElement('span'));
  swatch.className = 'swatch';
  swatch.style.setProperty('--color', `var(--${profileVariable(i)})`);
  heading.append(profiles[i].label);
  figure.dataset.ofProfile = i;
  document.querySelector(`[data-per-profile="${parent}"]`).append(figure);
  return figure;
}

let relative = false;

/** The terms stacked, the sum first: each area is drawn over the one before, so what stays seen of it is its share. */
function stacked(profile) {
  const { t, shares } = profile;
  const total = t.map((_, k) => shares.reduce((sum, share) => sum + share[k], 0));
  const sums = t.map(() => 0);
  const layers = shares.map((share) =>
    share.map((value, k) => (sums[k] += relative ? (total[k] > 0 ? (100 * value) / total[k] : 0) : value)),
  );
  return columns(layers.reverse().map((values) => ({ t, values })));
}

/** From 0 to what all but a few points stay below, of those at which the arm had something to do: a spike leaves the others to be read. `say` gets what is cut off, or nothing. */
const withoutSpikes = (values, max, say) => {
  const known = values.filter((value) => value > 1e-6 * max).sort((a, b) => a - b), usual = known[Math.floor(0.98 * (known.length - 1))] ?? 0;
  const cut = usual > 0 && max > 5 * usual;
  say(cut ? `Cut off above: peaks of up to ${format(max)}.` : '');
  return [0, cut ? 2 * usual : 1.05 * max || 1];
};

const objectiveCharts = profiles.map((profile, i) => {
  const terms = profile.terms.length, figure = addFigure('objective', i), note = figure.appendChild(document.createElement('p'));
  note.className = 'lead cut';
  const chart = addChart({
    figure,
    columns: stacked(profile),
    gridOnTop: true,
    range: (u, min, max) => {
      const [from, to] = u.series[0].idxs ?? [0, u.data[0].length - 1];
      return relative ? [0, 100] : withoutSpikes(u.data[1].slice(from, to + 1), max, (words) => { note.textContent = words; });
    },
    series: profile.terms
      .map((label, term) => ({
        label,
        title: profile.term_names[term],
        color: () => color(`term-${(term % 8) + 1}`),
        fill: () => color(`term-${(term % 8) + 1}`),
        width: 0.5,
        value: (u, value, series, k) => {
          if (k == null) return '–';
          const below = term === 0 ? 0 : u.data[terms - term + 1][k];
          return format(u.data[terms - term][k] - below, relative ? '%' : '');
        },
      }))
      .reverse(),
  });
  chart.columns = () => stacked(profile);
  return chart;
});

document.getElementById('around').hidden = profiles.every((profile) => profile.objects.length === 0);
profiles.forEach((profile, i) => {
  if (profile.objects.length === 0) return;
  addChart({
    figure: addFigure('objects', i),
    columns: [profile.t, ...profile.object_distances],
    unit: 'mm',
    plugins: [lineMarks([{ at: 0, text: 'contact', color: 'limit' }])],
    range: including(0),
    series: profile.objects.map((label, object) => ({ label, color: () => color(`term-${(object % 8) + 1}`), width: 1.3 })),
  });
});

profiles.forEach((profile, i) => {
  addChart({
    figure: addFigure('speeds', i),
    columns: columns(profile.speeds.percent.map((values) => ({ t: profile.speeds.t, values }))),
    unit: '%',
    plugins: [lineMarks([{ at: 100, text: 'limit', color: 'limit' }])],
    range: (u, min, max) => [0, Math.max(108, 1.05 * max)],
    series: profile.joints.map((label, joint) => ({ label, title: profile.joint_names[joint], color: () => color(`joint-${(joint % 8) + 1}`), width: 1.3 })),
  });
});

// ---------------------------------------------------------------------------------------------- controls

const themeButton = document.getElementById('theme');
const prefersDark = matchMedia('(prefers-color-scheme: dark)');
const isDark = () => (root.dataset.theme ? root.dataset.theme === 'dark' : prefersDark.matches);

function repaint() {
  themeButton.textContent = isDark() ? 'Light' : 'Dark';
  charts.forEach(build);
}
themeButton.addEventListener('click', () => {
  root.dataset.theme = isDark() ? 'light' : 'dark';
  repaint();
});
prefersDark.addEventListener('change', repaint);
themeButton.textContent = isDark() ? 'Light' : 'Dark';

// Paper is white.
let themeBeforePrint;
addEventListener('beforeprint', () => {
  themeBeforePrint = root.dataset.theme;
  root.dataset.theme = 'light';
  repaint();
});
addEventListener('afterprint', () => {
  if (themeBeforePrint) root.dataset.theme = themeBeforePrint;
  else delete root.dataset.theme;
  repaint();
});

for (const box of document.querySelectorAll('[data-profile]')) {
  box.addEventListener('change', () => {
    const i = Number(box.dataset.profile);
    shownProfiles[i] = box.checked;
    for (const { plot, spec } of charts) {
      spec.series.forEach((series, k) => series.profile === i && plot.setSeries(k + 1, { show: box.checked }));
    }
    for (const figure of document.querySelectorAll(`[data-of-profile="${i}"]`)) figure.hidden = !box.checked;
  });
}

const relativeButton = document.getElementById('relative');
relativeButton.addEventListener('click', () => {
  relative = !relative;
  relativeButton.textContent = relative ? 'Show absolute values' : 'Show shares in %';
  objectiveCharts.forEach(build);
});

// Once it is known which parts this report has.
addEventListener('DOMContentLoaded', () => {
  const contents = document.getElementById('contents');
  for (const heading of document.querySelectorAll('main h2[id]')) {
    if (!heading.checkVisibility()) continue;
    const words = heading.cloneNode(true);
    words.querySelector('.unit')?.remove();
    contents.append(Object.assign(document.createElement('a'), { href: `#${heading.id}`, textContent: words.textContent.trim() }));
  }
  contents.hidden = false;
});

root.dataset.charts = charts.length;
