import './style.css';
import { browserSurroundings, Connection, workerSurroundings } from './connection';
import { Cameras } from './cameras';
import { FirstSteps } from './first_steps';
import { Hand } from './hand';
import { Drag, listenForPresses } from './input/drag';
import { Gamepads, Keys } from './input/keys';
import { listenForShortcuts } from './input/shortcuts';
import { Objects } from './input/objects';
import { Headset } from './input/xr';
import { EpisodePanel } from './episodes';
import { element, onResize, put } from './element';
import { Panel, foldAll } from './panel';
import { Joints } from './plots/joints';
import { Plots } from './plots/plots';
import { forgetColors } from './profiles';
import { Recordings } from './recordings';
import type { Preset } from './scene/presets';
import { Stage } from './scene/stage';
import type { ServerMessage } from './protocol';
import { gripperOf } from './descriptions';
import { ON_TOUCH } from './means';
import { Session } from './session';
import { DisplayDelay, StudyPanel } from './study';
import { Tabs } from './tabs';

const canvas = element('scene', HTMLCanvasElement);
const reducedMotion = matchMedia('(prefers-reduced-motion: reduce)').matches;
const session = new Session();
if (matchMedia('(pointer: coarse)').matches) session.means = ON_TOUCH;
/** True on a page of `./steadyhand site`: it has no program. */
const alone = document.querySelector('meta[name="steadyhand-session"][content="worker"]') !== null;
if (alone) document.body.dataset.alone = 'true';
/** Offline after the first visit; where browsers allow none (plain HTTP of another machine) the page works as it is. */
let toBeKept = alone && 'serviceWorker' in navigator;
/** A session in a Worker starts to load at once: the stage below takes a while. */
const surroundings = alone ? workerSurroundings((why) => { session.failure = why; }, (kept) => recordings.kept.take(kept)) : browserSurroundings();
const stage = new Stage(canvas, reducedMotion);
const now = () => performance.now() / 1000;

const code = new URLSearchParams(location.hash.slice(1)).get('code') ?? '';
// Keeps the code out of the address bar, so that it is not copied with the address.
if (code) history.replaceState(null, '', location.pathname + location.search);

element('unstarted', HTMLElement).remove();

let plots: Plots | null = null, joints: Joints | null = null;
let shown = '';

const delay = new DisplayDelay((message) => take(message));
const study = new StudyPanel(stage.base, delay, (key, value) => connection.send({ type: 'reply', content: { key, value } }));

const connection = new Connection(surroundings, code, (message) => delay.take(message, now()), (status) => {
  session.connectionBecame(status, connection.ended);
  if (status === 'open') return;
  letGo();
  recordings.kept.cut(); // the Worker ends with its connection
});

const cameras = new Cameras(connection.clock, (names) => connection.send({ type: 'watch', cameras: names }));
connection.onPicture = (message) => cameras.take(message, now(), delay.seconds);
const tellCameras = () => cameras.tell(now(), session.paired, session.status === 'open' && !session.past, headset.session !== null);
document.addEventListener('visibilitychange', tellCameras);

function take(message: ServerMessage): void {
  session.take(message, now());
  if (message.type === 'welcome') recorded = null; // another program, perhaps: its first state fetches the list
  if (message.type === 'study') study.take(message.content);
  if (message.type === 'state') {
    plots?.take(message);
    if (toBeKept) { // not earlier: it fetches all files once more
      toBeKept = false;
      navigator.serviceWorker.register('./offline.js').catch(() => {});
    }
    if (message.recording !== recorded && !alone && (recorded !== null || !session.paired)) void recordings.refresh();
    recorded = message.recording;
  }
  if (message.type === 'paired' && !alone) {
    void recordings.refresh();
    if (!recordings.player) void recordings.follow();
  }
  if (message.type === 'cameras') cameras.end(message.ended);
  if (message.type === 'cell') stage.setCell(message.cell);
  if (message.type !== 'welcome') return;
  panel.offer(message);
  cameras.offer(message.cameras);
  const { robot, cell, glass, profiles } = message, told = JSON.stringify([robot?.name, glass, profiles]);
  stage.setCell(cell);
  // The same server after a lost connection: the drawing continues.
  if (told === shown) return;
  shown = told;
  recordings.replay.profiles = profiles;
  recordings.replay.joints = robot?.joints ?? [];
  recordings.replay.rim = gripperOf(robot) ? 0 : 1000 * glass.height;
  plots = new Plots(element('plots', HTMLDivElement), document.querySelector<HTMLElement>('#compare tbody')!, profiles, message.recordings);
  if (!robot) return;
  if (session.hasTwo) canvas.ariaLabel = 'The arms, their glasses and targets. Tab chooses the other arm, Shift and Tab leave the scene';
  if (session.hasTwo && drags.length < 2) drags.push(new Drag(stage, hands[1]!, session, wantLease, canvas, 1));
  joints = new Joints(element('joints', HTMLDivElement), robot);
  session.active = 0; // of another robot
  void stage.setRobot(robot, glass);
}

const tabs = new Tabs();
/** A report links back to the list by this. */
const toList = (): void => { if (location.hash === '#recordings') tabs.show('recordings'); };
toList();
addEventListener('hashchange', toList);
const count = { sequence: 0 };
/** Of the robot's first and second tool. */
const hands = [0, 1].map((tool) => new Hand(connection, now, () => session.yours && !session.past, tool, count));
const letGo = () => hands.forEach((hand) => hand.letGo());
/** The tool that mouse and keys move. */
const activate = (tool: number) => { session.active = tool; };
/** The same, by a key or a button: an engaged hand keeps its tool. */
const choose = (tool: number) => {
  if (hands.some(({ source }) => source !== null)) session.hint('Release first, then choose the other arm.', now());
  else activate(tool);
};

const recordings = new Recordings(element('recordings', HTMLUListElement), element('past', HTMLDivElement), (shown) => {
  if (shown) letGo();
  if (shown) tabs.show('recordings');
  stage.view.shows(shown);
  session.past = shown;
}, (kind, text, to) => {
  session.lastError = null;
  panel.command(kind, to === undefined ? { text } : { text, to });
}, () => session.lastError?.message ?? '', () => (session.paired ? surroundings.readToken() : ''));
let recorded: boolean | null = null;
const panel = new Panel(session, connection, hands, choose);
const episodes = new EpisodePanel(session, panel);
const firstSteps = new FirstSteps(() => panel.playFirst(), letGo, () => fit());
const words = element('top', HTMLElement);
const keepClear = () => {
  const right = Math.max(0, ...[...words.children].map((card) => (card as HTMLElement).offsetLeft + (card as HTMLElement).offsetWidth));
  stage.view.cover((words.offsetLeft + right) / Math.max(1, canvas.clientWidth), (words.offsetTop + words.offsetHeight + 8) / Math.max(1, canvas.clientHeight));
};
const fit = () => {
  stage.resize(canvas.clientWidth, canvas.clientHeight, firstSteps.room(canvas));
  keepClear();
};
/** Shows the scene to an operator who engages. True: that requested control. */
const wantLease = () => {
  firstSteps.closeHelp();
  return panel.takeOver();
};
/** Stops the arm first, then closes what might cover Reset. */
const stop = () => {
  panel.stop();
  firstSteps.closeHelp(true);
  foldAll();
};
element('stop', HTMLButtonElement).onclick = stop;
const drags = [new Drag(stage, hands[0]!, session, wantLease, canvas)];
listenForPresses(canvas, drags, activate, () => session.active);
const objects = new Objects(stage, () => drags.some(({ controls }) => controls.axis !== null), session, connection, canvas, () => panel.takeLease());
element('add-box', HTMLButtonElement).onclick = () => objects.addBox();
element('remove-object', HTMLButtonElement).onclick = () => objects.remove();
element('carry-object', HTMLButtonElement).onclick = () => objects.carry();
listenForShortcuts(stop, () => panel.reset(), () => session.stands(now()));
/** Ahead is where the operator looks: in a headset by the heading, otherwise as the scene is seen. */
const looks = () => (headset.session ? (session.state?.controls.yaw ?? 0) : stage.view.heading);
// Only where a press in the scene, or a key of the arm, put the focus: Tab alone never comes here, so it is no trap.
canvas.addEventListener('keydown', (event) => {
  if (event.key !== 'Tab' || event.shiftKey || !session.hasTwo) return;
  event.preventDefault();
  choose(1 - session.active);
});
const keys = new Keys(() => {
  if (session.hasTwo && document.activeElement === document.body) canvas.focus({ preventScroll: true }); // Tab acts there
  return hands[session.active]!;
}, session, wantLease, looks);
const gamepads = new Gamepads(hands, session, wantLease, looks, stop, (closed, tool) => panel.squeeze(closed, tool), now);
const headset = new Headset(stage, hands, session, connection, { wantLease, stop, reset: () => panel.reset(), command: (kind, more) => panel.command(kind, more) }, () => void offerHeadset());

async function offerHeadset(): Promise<void> {
  const { vr, ar } = await Headset.modes();
  for (const [id, mode, known, name] of [['enter-vr', 'immersive-vr', vr, 'VR'], ['enter-ar', 'immersive-ar', ar, 'AR']] as const) {
    const button = element(id, HTMLButtonElement);
    button.hidden = !known || (headset.mode !== null && headset.mode !== mode);
    button.textContent = `${headset.mode === mode ? 'Leave' : 'Enter'} ${name}`;
  }
  element('emulate', HTMLButtonElement).hidden = vr;
  element('keys', HTMLElement).hidden = headset.session !== null;
  element('emulated', HTMLElement).hidden = headset.session !== null || !headset.simulated;
  element('emulator', HTMLElement).hidden = headset.session === null || !headset.simulated;
}

const enter = (mode: 'immersive-vr' | 'immersive-ar') => () => {
  if (headset.session) void headset.session.end();
  else headset.enter(mode).then(() => {
    session.lastError = null;
    firstSteps.dismiss(); // the view of an emulated one covers it
    firstSteps.closeHelp();
  }, (error: unknown) => {
    const why = error instanceof Error ? error.message : String(error);
    session.lastError = { code: 'unknown', message: `The headset did not start: ${why} Put it on, allow this page to use it, and try again.` };
  });
};
element('enter-vr', HTMLButtonElement).onclick = enter('immersive-vr');
element('enter-ar', HTMLButtonElement).onclick = enter('immersive-ar');
element('emulate', HTMLButtonElement).onclick = () => void headset.emulate().then(offerHeadset);

const mode = element('mode', HTMLButtonElement);
mode.onclick = () => {
  const turning = mode.getAttribute('aria-pressed') !== 'true';
  mode.setAttribute('aria-pressed', String(turning));
  for (const drag of drags) drag.setMode(turning ? 'rotate' : 'translate');
};
element('bodies', HTMLInputElement).onchange = (event) => stage.arm?.showBodies((event.target as HTMLInputElement).checked);
element('reach', HTMLInputElement).onchange = (event) => stage.showReach((event.target as HTMLInputElement).checked);
const views = [...document.querySelectorAll<HTMLButtonElement>('[data-view]')], follow = element('follow', HTMLButtonElement);
/** The viewpoint, until the operator turns the view; and whether it follows the glass. */
const showView = (chosen: HTMLButtonElement | null) => {
  for (const view of views) view.setAttribute('aria-pressed', String(view === chosen));
  follow.setAttribute('aria-pressed', String(stage.view.follows));
};
for (const view of views) {
  view.onclick = () => {
    stage.view.follows = false;
    stage.view.look(view.dataset.view as Preset);
    showView(view);
  };
}
showView(views.find(({ dataset }) => dataset.view === 'shoulder') ?? null);
stage.view.orbit.addEventListener('start', () => {
  showView(null);
  if (stage.view.isPressed) session.turnsView(now());
});
follow.onclick = () => {
  stage.view.follows = !stage.view.follows;
  showView(null);
};
element('frame-all', HTMLButtonElement).onclick = () => {
  stage.frameAll();
  showView(null);
};

const dark = element('dark', HTMLInputElement);
dark.checked = matchMedia('(prefers-color-scheme: dark)').matches;
const repaint = () => {
  forgetColors();
  plots?.repaint();
};
dark.onchange = () => {
  document.documentElement.className = dark.checked ? 'dark' : 'light';
  stage.setDark(dark.checked);
  repaint();
};
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', ({ matches }) => {
  if (document.documentElement.className === '') stage.setDark(dark.checked = matches); // no theme was chosen
  repaint();
});

onResize(canvas, fit);
onResize(words, keepClear);

/** s between two updates of all texts and values. */
const WORDS_EVERY = 0.2;
/** s between two plots that are drawn: each of four comes four times a second, and moves by a point of the screen. */
const PLOT_EVERY = 1 / 16;

let last = now(), lastWords = 0, lastPlot = 0, frames = 0;
stage.renderer.setAnimationLoop((_time, frame) => {
  const t = now();
  const dt = t - last;
  last = t;
  ++frames;
  session.drew(dt);
  delay.release(t);
  cameras.draw(now());
  headset.update(frame, t, cameras.views);
  const mayDrag = !headset.session && session.mayLead(t);
  for (const drag of drags) {
    drag.show(mayDrag && (drag.tool === 0 || session.hasTwo), drags.every((other) => other === drag || !other.holding));
    drag.follow();
  }
  recordings.replay.advance(dt);
  stage.active = session.active;
  if (plots) plots.active = session.active;
  if (recordings.player) stage.showPast(recordings.player.q(), recordings.player, recordings.other, t);
  else if (session.state) stage.show(session.state, session.isStale(t), t);
  objects.draw();
  const wordsDue = t - lastWords > WORDS_EVERY, plotDue = t - lastPlot > (wordsDue ? 2 : 1) * PLOT_EVERY; // not in the same frame, if possible
  if (wordsDue) {
    lastWords = t;
    put(words.dataset, 'over', String(stage.view.isCovered && !stage.view.orbit.enabled));
    panel.draw(t, objects.chosen, objects.carries);
    firstSteps.draw(!session.paired, session.whyNoMotion, (session.state?.controls.playback ?? -1) >= 0, session.past);
    episodes.draw();
    tellCameras();
    if (session.state) joints?.draw(session.state);
    plots?.tell();
    recordings.replay.draw();
    if (!alone) recordings.grow(session.state?.recording === true && !session.isStale(t), !session.stands(t));
  }
  if (plotDue) {
    lastPlot = t;
    plots?.drawNext();
  }
  stage.keepPace(dt);
  if (session.isLate) stage.late(t);
  stage.draw(dt, t, wordsDue || plotDue);
});

// These events may change a scene that does not move, of which few frames are drawn.
for (const type of ['pointerdown', 'pointerup', 'keydown', 'keyup', 'wheel', 'change', 'click']) {
  addEventListener(type, () => stage.wake(), { capture: true, passive: true });
}
canvas.addEventListener('pointermove', () => stage.wake(), { passive: true });

// The rate of the hand does not depend on the frame rate; a hidden page controls nothing.
let lastHand = now();
setInterval(() => {
  const t = now(), gap = t - lastHand;
  const dt = Math.min(0.1, gap);
  lastHand = t;
  for (const hand of hands) hand.repeat(); // also if the page has just been hidden, which releases
  if (document.hidden) return;
  session.told(gap, hands.some(({ source }) => source !== null), t);
  if ((!headset.session || headset.simulated) && session.mayResume(t)) for (const hand of hands) hand.resume();
  keys.update(dt);
  gamepads.update(dt);
  for (const drag of drags) drag.report();
  headset.repeat(t);
}, 11);

element('blind', HTMLElement).hidden = !stage.blind;
void offerHeadset();
connection.start();

/** The page's objects, for tests and the browser's console. */
Object.assign(window, { steadyhand: { session, connection, hand: hands[0], hands, stage, drag: drags[0], drags, headset, recordings, cameras, frames: () => frames } });
