'use strict';

// What happened in a live session: its states as a band, its events in a list, and the arm as it moved. A replay has none of it.
{
  const { story } = data;
  const NAMES = { state: 'state', spill: 'spill', limit: 'limit', setting: 'setting', missed: 'deadlines', gap: 'gap', rest: 'rest', refill: 'refill' };
  /** Limits that are listed without being asked for; of more than that the other kinds would drown. */
  const FEW = 20;
  /** As page.css has them. */
  const PRINTED = ['state', 'spill'];
  /** mm over the rim that are drawn. */
  const MOST_OVER = -15;
  /** By the program that has the recordings; of a file, or of another server, nobody knows where they are. */
  const SERVED = /^http.*\/sessions\/[^/]+\/report\.html$/.test(location.origin + location.pathname);
  /** The operator's page with this replay. */
  const replay = `../../#replay=${encodeURIComponent(document.querySelector('h1').dataset.recording)}`;
  function stateSpans({ events, begin, end }) {
    const states = events.filter(({ kind }) => kind === 'state');
    return states.map(({ t, what }, i) => ({ from: t, to: states[i + 1]?.t ?? end, state: what })).filter(({ to }) => to >= begin);
  }

  /** All plots over time show what is around t, with a line there, or everything. */
  function lookAt(t) {
    const { begin, end } = story, at = Math.min(end, Math.max(begin, t ?? begin)); // what happened may be told of a time just outside
    const near = t === null ? [begin, end] : [Math.max(begin, at - 3), Math.min(end, at + 3)];
    const overTime = charts.filter(({ spec }) => !spec.x);
    for (const { plot } of overTime) plot.setScale('x', { min: near[0], max: near[1] });
    requestAnimationFrame(() => { // scales are of the next picture
      for (const { plot } of overTime) plot.setCursor({ left: t === null ? -10 : plot.valToPos(t, 'x'), top: 0 }, false);
    });
    document.dispatchEvent(new CustomEvent('look', { detail: t }));
  }

  function showEvents(root, { events, begin, end }) {
    const band = root.querySelector('.states'), share = (t) => `${(100 * (t - begin)) / Math.max(1e-9, end - begin)}%`;
    for (const { from, to, state } of stateSpans(story)) {
      const span = band.appendChild(document.createElement('i'));
      span.style.left = share(Math.max(from, begin));
      span.style.width = share(begin + to - Math.max(from, begin));
      span.style.background = `var(--state-${state})`;
      span.dataset.state = state;
      span.title = `${state} from ${seconds(from)} to ${seconds(to)}`;
    }
    for (const { t, kind, what } of events) {
      if (kind === 'state' || kind === 'setting' || kind === 'rest') continue;
      const mark = band.appendChild(document.createElement('b'));
      mark.className = kind;
      mark.style.left = share(t);
      mark.title = `${seconds(t)}: ${what}`;
    }
    showLegend(root.querySelector('.legend'), band);
    const rows = root.querySelector('tbody'), counts = {};
    for (const { t, kind, what, why } of events) {
      counts[kind] = (counts[kind] ?? 0) + 1;
      const row = rows.appendChild(document.createElement('tr'));
      row.dataset.kind = kind;
      const at = row.appendChild(document.createElement('th')).appendChild(document.createElement('a'));
      row.firstChild.scope = 'row';
      at.href = `#t=${t.toFixed(3)}`;
      at.textContent = seconds(t);
      row.appendChild(document.createElement('td')).textContent = NAMES[kind] ?? kind;
      row.appendChild(document.createElement('td')).textContent = why ? `${what}: ${why}` : what;
    }
    const kinds = root.querySelector('.kinds');
    for (const [kind, count] of Object.entries(counts)) {
      const label = kinds.appendChild(document.createElement('label')), box = label.appendChild(document.createElement('input'));
      box.type = 'checkbox';
      box.checked = kind !== 'limit' || count <= FEW;
      label.append(` ${NAMES[kind] ?? kind} (${count})`);
      (box.onchange = () => rows.querySelectorAll(`[data-kind="${kind}"]`).forEach((row) => { row.hidden = !box.checked; }))();
    }
    const list = root.querySelector('.scroll');
    /** The row of this time, or what came last before it, of those that are listed. */
    const rowAt = (t) => [...rows.children].filter((row) => !row.hidden && Number(row.querySelector('a').hash.slice(3)) <= t + 0.0005).pop();
    const follow = () => {
      const at = /#t=([\d.]+)/.exec(location.hash), exact = at && [...rows.children].find((row) => !row.hidden && row.querySelector('a').hash === at[0]);
      const current = at ? (exact ?? rowAt(Number(at[1]))) : undefined;
      for (const row of rows.children) row.ariaCurrent = row === current ? 'true' : null;
      if (!at) return;
      if (current) list.scrollTop += current.getBoundingClientRect().top - list.getBoundingClientRect().top - (list.clientHeight - current.offsetHeight) / 2;
      lookAt(Number(at[1]));
      // All that is told of this time, where the window holds it; otherwise the arm, or the first plot.
      const all = root.querySelector('.happened'), arm = document.getElementById('arm');
      (all.offsetHeight <= innerHeight ? all : arm.hidden ? document.querySelector('.uplot').parentElement : arm).scrollIntoView({ block: 'nearest' });
    };
    addEventListener('hashchange', follow);
    printsShort(root, rows);
    root.querySelector('#whole').onclick = () => { history.replaceState(null, '', '#'); follow(); lookAt(null); };
    setTimeout(follow);
  }

  /** What the colours of the band mean, of those that are in it. */
  function showLegend(legend, band) {
    const add = (sign, name) => {
      const item = legend.appendChild(document.createElement('span'));
      const shown = item.appendChild(sign.cloneNode());
      shown.removeAttribute('title');
      shown.style.left = shown.style.width = '';
      item.append(` ${name}`);
    };
    const signs = new Map([...band.children].map((sign) => [sign.className ? NAMES[sign.className] ?? sign.className : sign.dataset.state, sign]));
    for (const [name, sign] of signs) add(sign, name);
  }

  /** Paper has the plots first, and of the events those that one looks for; page.css leaves out the others. */
  function printsShort(root, rows) {
    const note = root.querySelector('.left-out'), after = root.nextElementSibling;
    addEventListener('beforeprint', () => {
      const left = [...rows.children].filter(({ dataset, hidden }) => hidden || !PRINTED.includes(dataset.kind)).length;
      note.textContent = left > 0 ? `${left} more ${left === 1 ? 'event is' : 'events are'} not printed: of limits, settings, deadlines and the like. The report itself lists them.` : '';
      root.parentElement.append(root);
    });
    addEventListener('afterprint', () => after.before(root));
  }

  function showLatency({ latency }) {
    if (latency.t.length < 2) return;
    const figure = document.querySelector('[data-chart="latency"]');
    figure.hidden = false;
    addChart({
      figure,
      columns: columns([{ t: latency.t, values: latency.p50 }, { t: latency.t, values: latency.p99 }]),
      series: [{ label: 'median so far', color: () => color('ink') }, { label: 'p99 so far', color: () => color('muted'), dash: [4, 3] }],
      unit: 'ms',
      range: including(0),
    });
  }

  /** A line at each spill, from the rim down. */
  const spillMarks = (events) => overlay(({ ctx, bbox, valToPos }) => {
    ctx.fillStyle = color('liquid');
    for (const { t, kind } of events) if (kind === 'spill') ctx.fillRect(Math.round(valToPos(t, 'x', true)) - uPlot.pxRatio, bbox.top, 2 * uPlot.pxRatio, 12 * uPlot.pxRatio);
  });

  /** How near the liquid came to the rim, and what was lost; of a glass only. */
  function showLiquid({ wave: { t, freeboard_mm, spilled }, events }) {
    if (t.length < 2) return;
    const show = (name, values, options) => {
      const figure = document.querySelector(`[data-chart="${name}"]`);
      figure.hidden = false;
      addChart({ figure, columns: columns([{ t, values }]), ...options });
      return figure;
    };
    const lost = spilled.some((share) => share > 0);
    const wave = show('wave', freeboard_mm, {
      series: [{ label: 'below the rim', color: () => color('ink') }],
      unit: 'mm',
      downwards: true, // the rim is above, as in the glass
      plugins: [lineMarks([{ at: 0, text: 'rim', color: 'limit' }]), spillMarks(events)],
      range: (u, min, max) => including(0)(u, Math.max(min, MOST_OVER), max), // how far over the rim says little: it is lost
    });
    wave.classList.toggle('wide', !lost);
    if (!lost) return;
    show('spilled', spilled, { series: [{ label: 'spilled', color: () => color('liquid'), fill: () => `color-mix(in srgb, ${color('liquid')} 25%, transparent)` }], unit: '%', range: (u, min, max) => [0, 1.05 * max || 1] });
  }

  // -------------------------------------------------------------------------------------------- the arm

  const times = (a, b) => a.map((row) => b[0].map((_, j) => row.reduce((sum, value, k) => sum + value * b[k][j], 0)));
  const identity = () => [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
  /** Rodrigues' formula. */
  function turn([x, y, z], angle) {
    const c = Math.cos(angle), s = Math.sin(angle), d = 1 - c;
    return [[c + x * x * d, x * y * d - z * s, x * z * d + y * s, 0], [y * x * d + z * s, c + y * y * d, y * z * d - x * s, 0], [z * x * d - y * s, z * y * d + x * s, c + z * z * d, 0], [0, 0, 0, 1]];
  }
  const shift = ([x, y, z], by) => [[1, 0, 0, x * by], [0, 1, 0, y * by], [0, 0, 1, z * by], [0, 0, 0, 1]];

  /** Where its joints and its tool are, base frame, and the tool's pose. */
  function chain(robot, q) {
    let pose = robot.mount ?? identity();
    const points = [pose.slice(0, 3).map((row) => row[3])];
    robot.joints.forEach(({ origin, axis, type }, i) => {
      pose = times(times(pose, origin), type === 'prismatic' ? shift(axis, q[i]) : turn(axis, q[i]));
      points.push(pose.slice(0, 3).map((row) => row[3]));
    });
    pose = times(pose, robot.tool.origin);
    points.push(pose.slice(0, 3).map((row) => row[3]));
    return { points, pose };
  }

  function showArm({ robot: text, postures }) {
    const figure = document.getElementById('arm');
    if (!text || postures.length < 2) return;
    figure.hidden = false;
    const robot = JSON.parse(text), canvas = figure.querySelector('canvas'), range = figure.querySelector('input'), told = figure.querySelector('output');
    const tools = postures.map(([, ...q]) => chain(robot, q).points.at(-1));
    let azimuth = -0.7, tilt = 0.35, at = 0, time = postures[0][0], chosen = time, link = null;
    /** The replay of this time: it counts from the arm's first posture. */
    const linkTo = (t) => { if (link) link.href = `${replay}&t=${Math.max(0, t - postures[0][0]).toFixed(2)}`; };
    range.max = String(postures.length - 1);
    const project = ([x, y, z]) => {
      const u = x * Math.sin(azimuth) + y * Math.cos(azimuth), v = x * Math.cos(azimuth) - y * Math.sin(azimuth);
      return [-u, z * Math.cos(tilt) + v * Math.sin(tilt) - 0.3];
    };
    const draw = () => {
      const ratio = devicePixelRatio, width = canvas.clientWidth * ratio, height = canvas.clientHeight * ratio, c = canvas.getContext('2d');
      canvas.width = width;
      canvas.height = height;
      const unit = Math.min(width, height) / 1.45;
      const line = (points, name, thick, alpha = 1) => {
        c.beginPath();
        points.map(project).forEach(([u, v], i) => c[i ? 'lineTo' : 'moveTo'](width / 2 + unit * u, height / 2 - unit * v));
        c.strokeStyle = color(name);
        c.globalAlpha = alpha;
        c.lineWidth = thick * ratio;
        c.lineJoin = c.lineCap = 'round';
        c.stroke();
        c.globalAlpha = 1;
      };
      for (let k = -3; k <= 3; ++k) {
        line([[k / 4, -0.75, 0], [k / 4, 0.75, 0]], 'grid', 1);
        line([[-0.75, k / 4, 0], [0.75, k / 4, 0]], 'grid', 1);
      }
      line(tools, 'muted', 1, 0.5);
      line(tools.slice(Math.max(0, at - 20), at + 1), 'ink', 2, 0.8);
      const [, ...q] = postures[at], { points, pose } = chain(robot, q);
      line(points, 'muted', 9);
      line(points, 'panel', 4);
      const [x, y, z] = points.at(-1), up = [0, 1, 2].map((i) => pose[i][2] * 0.05);
      line([[x - up[0], y - up[1], z - up[2]], [x + up[0], y + up[1], z + up[2]]], 'liquid', 8);
      told.textContent = seconds(time);
      range.value = String(at);
      range.setAttribute('aria-valuetext', told.textContent);
    };
    const indexAt = (t) => {
      const index = postures.findIndex(([time]) => time >= t);
      return index < 0 ? postures.length - 1 : index;
    };
    const show = (t, index = indexAt(t)) => {
      if (index === at && t === time) return;
      [at, time] = [index, t];
      draw();
    };
    range.oninput = () => {
      const index = Number(range.value);
      linkTo(chosen = postures[index][0]);
      show(chosen, index);
    };
    canvas.onpointermove = (event) => {
      if (!event.buttons) return;
      azimuth += event.movementX * 0.01;
      tilt = Math.min(1.4, Math.max(-0.2, tilt + event.movementY * 0.01));
      draw();
    };
    document.addEventListener('look', ({ detail: t }) => {
      if (t === null) return;
      linkTo(chosen = t);
      show(t);
    });
    document.addEventListener('point', ({ detail: t }) => show(t ?? chosen));
    new ResizeObserver(draw).observe(canvas);
    document.getElementById('theme').addEventListener('click', draw);
    if (SERVED) {
      link = figure.querySelector('a');
      link.hidden = false;
      linkTo(postures[0][0]);
    }
  }

  const section = document.getElementById('story');
  if (SERVED) {
    const ways = document.querySelector('.bar nav'), to = { recordings: '../../#recordings', replay };
    ways.hidden = false;
    for (const link of ways.children) link.href = to[link.dataset.to];
  }
  if (story) {
    section.hidden = false;
    showEvents(section, story);
    showLiquid(story);
    showLatency(story);
    showArm(story);
  }
}
