import { made, put } from '../element';
import { forgetColors } from '../profiles';
import type { Robot } from '../protocol';
import { Player } from '../replay/player';
import { Replay } from '../replay/replay';
import { ArmFigure } from './arm';
import { Charts } from './charts';
import type { Report, Session } from './data';
import { cardsOf, legendOf, meaningsOf, noteOf, tablesOf, timeText, titleOf, toolOf, verdictOf } from './head';
import { showPlots } from './plots';
import './report.css'; // after uPlot's styles

/** s shown before and after a time that a link opens. */
const AROUND = 3;
/** ms between two updates during playback. */
const OFTEN = 100;
const report = JSON.parse(document.getElementById('data')!.textContent!) as Report, { session } = report, root = document.documentElement;
const by = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;
/** Served by the program that has the recordings; from a file or another server their place is unknown. */
const isServed = /^http.*\/sessions\/[^/]+\/report\.html$/.test(location.origin + location.pathname);
/** This replay on the operator's page. */
const inScene = `../../#replay=${encodeURIComponent(report.recording)}`;

const charts = new Charts(report.profiles.length, session ? [session.begin, session.end] : null, timeText);
/** Redraws the other canvases after a change of theme. */
let repaintOthers = (): void => {};

function showHead(): void {
  const title = titleOf(report), length = Math.max(...report.profiles.map(({ t }) => t[t.length - 1]! - t[0]!));
  document.title = `${title} · steadyhand`;
  by('title').textContent = title;
  for (const each of document.querySelectorAll('.tool')) each.textContent = toolOf(report);
  if (session?.knows_liquid) by('verdict').append(verdictOf(session.motion?.events?.filter(({ kind }) => kind === 'spill') ?? [], session.zero_s));
  by('rate').textContent = `${report.rate_hz} Hz`;
  by('scale').textContent = report.scales;
  by('length').textContent = session ? `${timeText(session.end - session.begin)}, ${timeText(session.led_s)} engaged` : `${length.toFixed(1)} s`;
  by('cards').append(...cardsOf(report, (profile, shown) => {
    charts.show(profile, shown);
    for (const figure of document.querySelectorAll<HTMLElement>(`[data-of-profile="${profile}"]`)) figure.hidden = !shown;
  }));
  by('tables').append(...tablesOf(report));
  by('bold').hidden = report.figures.every(({ best }) => best < 0);
  by('meanings').append(...meaningsOf(report));
  by('note').textContent = noteOf(report);
  by('recording').textContent = report.recording;
  by('command').textContent = report.command;
  by('ways').hidden = !isServed;
  by<HTMLAnchorElement>('to-recordings').href = '../../#recordings';
  by<HTMLAnchorElement>('to-replay').href = inScene;
}

/** For a live session: the replay of the operator's page, and the arm. */
function showReplay({ motion, robot: text }: Session): void {
  if (!motion || motion.t_s.length < 2) return;
  by('story').hidden = false;
  const player = new Player(motion), robot = text ? JSON.parse(text) as Robot : null, link = by<HTMLAnchorElement>('in-scene');
  const replay = new Replay(() => '#', (span) => charts.look(span[1] - span[0] >= player.duration ? null : span), motion.events?.some(({ kind }) => kind === 'spill') ? ['spilled'] : []);
  replay.joints = robot?.joints ?? [];
  replay.profiles = report.profiles.map(({ name, label }, index) => ({ name, label: label.replace(/, scale .*$/, ''), index, weights: [] }));
  replay.open(player);
  link.hidden = !isServed;
  by('legend').append(...legendOf(motion.events ?? []));
  const arm = robot ? new ArmFigure(by('arm'), robot, player) : null;
  by('arm').hidden = !arm;
  let pointed: number | null = null, seen = 0;
  charts.onLook = (span) => replay.look(span ?? [0, Math.max(0.1, player.duration)]);
  charts.onPoint = (t) => {
    pointed = t;
    arm?.show(t ?? player.at);
  };
  repaintOthers = () => {
    replay.repaint();
    arm?.draw();
  };
  let before = performance.now();
  const draw = (): void => {
    const now = performance.now();
    replay.advance((now - before) / 1000);
    before = now;
    replay.draw();
    put(link, 'href', `${inScene}&t=${player.at.toFixed(2)}`);
    if (player.at === seen) return;
    seen = player.at;
    if (pointed !== null) return;
    charts.mark(seen);
    arm?.show(seen);
  };
  setInterval(draw, OFTEN);
  /** Reads the address: #t=S, s from the start. */
  const follow = (): void => {
    const at = Number(/^#t=([\d.]+)/.exec(location.hash)?.[1] ?? NaN);
    if (!Number.isFinite(at)) return;
    player.playing = false;
    player.seek(at);
    charts.look([Math.max(0, player.at - AROUND), Math.min(player.duration, player.at + AROUND)]);
    draw();
    by('story').scrollIntoView({ block: by('story').offsetHeight <= innerHeight ? 'nearest' : 'start' });
  };
  addEventListener('hashchange', follow);
  draw();
  setTimeout(follow);
  printShort();
}

/** In print, the plots come first, with the important events only; report.css hides the others. */
function printShort(): void {
  const story = by('story'), after = story.nextElementSibling!;
  addEventListener('beforeprint', () => {
    const left = by('past-events').querySelectorAll('.minor, [hidden]').length;
    by('left-out').textContent = left > 0 ? `${left} more ${left === 1 ? 'event is' : 'events are'} not printed: of limits, settings, deadlines and the like. The report itself lists them.` : '';
    story.parentElement!.append(story);
  });
  addEventListener('afterprint', () => after.before(story));
}

const prefersDark = matchMedia('(prefers-color-scheme: dark)');
const isDark = (): boolean => root.classList.contains('dark') || (!root.classList.contains('light') && prefersDark.matches);
function repaint(): void {
  by('theme').textContent = isDark() ? 'Light' : 'Dark';
  forgetColors();
  charts.rebuild();
  repaintOthers();
}
function paint(theme: string): void {
  root.className = theme;
  repaint();
}

function listenToButtons(): void {
  by('theme').textContent = isDark() ? 'Light' : 'Dark';
  by('theme').onclick = () => paint(isDark() ? 'light' : 'dark');
  prefersDark.addEventListener('change', repaint);
  let before = '';
  addEventListener('beforeprint', () => {
    before = root.className;
    paint('light'); // paper is white
  });
  addEventListener('afterprint', () => paint(before));
  const relative = by('relative');
  relative.onclick = () => {
    const shares = relative.getAttribute('aria-pressed') !== 'true';
    relative.setAttribute('aria-pressed', String(shares));
    charts.rebuild(({ gridOnTop }) => gridOnTop === true);
  };
}

/** Links to the sections of this report. */
function showContents(): void {
  for (const heading of document.querySelectorAll<HTMLElement>('main h2[id]')) {
    if (!heading.checkVisibility()) continue;
    const words = heading.cloneNode(true) as HTMLElement;
    words.querySelector('.unit')?.remove();
    by('contents').append(made('a', { href: `#${heading.id}` }, words.textContent!.trim()));
  }
}

showHead();
showPlots(report, charts);
if (session) showReplay(session);
listenToButtons();
showContents();
root.dataset.charts = String(charts.count);
