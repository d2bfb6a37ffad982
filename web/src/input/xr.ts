import * as THREE from 'three';
import type { Hand } from '../hand';
import { latencyText, scaleText } from '../figures';
import { heading, toRobot, toRobotRotation, type MutablePose } from '../frames';
import type { CameraView } from '../camera_view';
import type { Connection } from '../connection';
import { IN_EMULATOR, IN_HEADSET, type Means, ON_PAGE } from '../means';
import { type Session, waveText } from '../session';
import type { Stage } from '../scene/stage';
import { STATE_COLORS } from '../scene/tool_colors';
import { Board } from './board';
import { A, B, Buttons, GRIP, isController, STICK, TRIGGER } from './controllers';
import type { EmulatedHand } from './emulator';
import { Guide } from './guide';
import { itemsOf, type Asks } from './menu';
import { Pointer } from './pointer';
import { Screens } from './screens';
import { isLimitOf, toolOf } from './sides';

/** Hz, requested from the headset: at a higher rate each frame has too little time. */
const RATE = 72;
/** s: a longer prediction by the device is not a valid time. */
const LEAD_MAX = 0.1;

/** Size of an emulated headset's labels, relative to those of a real one. */
const ON_SCREEN = 1.5;

/** What the operator may request in the headset. */
export interface Acts {
  /** True: that took control. */
  wantLease(): boolean;
  stop(): void;
  reset(): void;
  command: Asks['command'];
}

/** The controller that has, or had, a tool's hand, and its last report. */
interface Grip { handedness: XRHandedness; readonly pose: MutablePose; known: boolean; guessed: boolean; lead: number; at: number; constrained: boolean }

const noGrip = (): Grip => ({ handedness: 'none', pose: { p: [0, 0, 1], q: [0, 0, 0, 1] }, known: false, guessed: false, lead: 0, at: Infinity, constrained: false });

/**
 * A headset. The grip of either controller engages, and that controller keeps the arm. B or Y of either stops. A
 * thumbstick scales up and down, and chooses on the board to either side; pressed, it resets, or presses the chosen
 * item. A or X sets forward to where the operator looks; the arm moves only after that. A trigger presses what its ray
 * is on, or moves the board; that of the engaged controller tilts the glass to pour. If the robot has two tools, each
 * hand has its tool, and X swaps them.
 */
export class Headset {
  /** Emulated by the page itself. */
  simulated = false;
  session: XRSession | null = null;
  /** Of the current session. */
  mode: 'immersive-vr' | 'immersive-ar' | null = null;
  readonly board = new Board();
  /** The session's cameras. */
  readonly screens = new Screens(this.board.geometry.parameters.height / 2 + 0.02);
  /** s, by which the headset predicted its newest poses; for the figures in docs/explanation/results.md. */
  readonly leads: number[] = [];
  readonly guide = new Guide();
  readonly #pointer = new Pointer(this.board);
  readonly #rig = new THREE.Group();
  readonly #buttons = new Buttons();
  /** By tool. */
  readonly #grips: readonly Grip[];
  /** Each hand moves the tool of the other side. */
  #swapped = false;
  /** Forward was set after the origin last moved. */
  #isForwardKnown = false;
  /** Pressed on the board. */
  #wantsForward = false;
  /** The operator has chosen a scale; until then the hand's motion is the glass's. */
  #isScaled = false;
  /** Scale and heading from before this session changed them. */
  #before: { scale: number; yaw: number } | null = null;
  #scaleAt = 0;
  #chooseAt = 0;
  /** rad, tilt after pouring; null: not pouring. */
  #tiltAfter: number | null = null;
  #wroteAt = 0;
  #meansBefore: Means = ON_PAGE;
  readonly #eye = new THREE.Vector3();
  #mouse: EmulatedHand | null = null;

  constructor(private readonly stage: Stage, private readonly hands: readonly Hand[], private readonly facts: Session,
              private readonly connection: Connection, private readonly acts: Acts, private readonly onChange: () => void) {
    this.#grips = hands.map(noGrip);
    this.board.position.set(-0.6, 1.5, -1.2);
    this.board.add(this.screens);
    this.#rig.add(this.board, this.#pointer, this.guide.notice);
    this.#rig.visible = false;
    stage.scene.add(this.#rig);
    for (const index of [0, 1]) {
      const grip = stage.renderer.xr.getControllerGrip(index);
      const body = new THREE.Mesh(new THREE.CapsuleGeometry(0.014, 0.07, 6, 16), new THREE.MeshStandardMaterial({ color: 0xf0f3f6, roughness: 0.4 }));
      body.rotation.x = -Math.PI / 3;
      grip.add(body);
      this.guide.attach(grip);
      stage.scene.add(grip);
    }
  }

  static async modes(): Promise<{ vr: boolean; ar: boolean }> {
    const ask = async (mode: XRSessionMode): Promise<boolean> => {
      try { return (await navigator.xr?.isSessionSupported(mode)) ?? false; } catch { return false; }
    };
    return { vr: await ask('immersive-vr'), ar: await ask('immersive-ar') };
  }

  /** A Quest 3 of `iwer` in place of the browser's own WebXR. */
  async emulate(): Promise<void> {
    const { EmulatedHand, emulatedQuest } = await import('./emulator');
    const device = emulatedQuest();
    this.simulated = true;
    this.guide.showOnScreen(ON_SCREEN);
    this.#mouse = new EmulatedHand(device, this.stage.renderer.domElement, (from, along) => this.#pointer.distance(from, along));
    Object.assign(window, { emulatedHeadset: device });
  }

  async enter(mode: 'immersive-vr' | 'immersive-ar'): Promise<void> {
    // Without `layers` some browsers have the projection layer that three.js draws to, but no camera image behind it.
    const session = await navigator.xr!.requestSession(mode, { optionalFeatures: ['local-floor', 'layers'] });
    const { xr } = this.stage.renderer;
    if (this.stage.vrShare < 1) xr.setFramebufferScaleFactor(this.stage.vrShare);
    try {
      await xr.setSession(session);
    } catch (error) {
      await session.end().catch(() => undefined);
      throw error;
    }
    this.session = session;
    this.mode = mode;
    this.#meansBefore = this.facts.means;
    this.facts.hint('', -Infinity); // removes hints from the page or an earlier session
    session.addEventListener('end', () => this.#left());
    session.addEventListener('visibilitychange', () => { if (session.visibilityState !== 'visible') this.#letGo(); });
    xr.getReferenceSpace()?.addEventListener('reset', () => this.#recentred());
    if (session.supportedFrameRates?.includes(RATE)) session.updateTargetFrameRate(RATE).catch(() => undefined);
    this.stage.present(mode, this.simulated);
    this.#rig.visible = true;
    if (this.#mouse) this.#mouse.running = true;
    for (const grip of this.#grips) grip.at = Infinity;
    this.#recentred();
    this.onChange();
  }

  #left(): void {
    this.#letGo();
    this.session = this.mode = null;
    this.facts.means = this.#meansBefore;
    this.#restore();
    this.#rig.visible = false;
    if (this.#mouse) this.#mouse.running = false;
    this.stage.present(null);
    this.onChange();
  }

  /** Restores scale and heading for the page's input devices. */
  #restore(): void {
    const { facts } = this, before = this.#before;
    this.#before = null;
    this.#isScaled = false;
    if (!before || !facts.yours) return;
    for (const kind of ['scale', 'yaw'] as const) this.connection.send({ type: 'request', kind, value: before[kind] });
    facts.hint('Scale and heading are as they were before VR.', performance.now() / 1000);
  }

  /** Keeps scale and heading before they change. */
  #remember(): void {
    const controls = this.facts.state?.controls;
    if (controls) this.#before ??= { scale: controls.scale, yaw: controls.yaw };
  }

  /** A button that is held now must be released before it counts again. */
  #letGo(): void {
    for (const hand of this.hands) hand.release('headset');
    this.#pour(false);
    this.#buttons.forget();
  }

  /** Poses before and after are unrelated, and forward is unknown. */
  #recentred(): void {
    this.#letGo();
    this.#isForwardKnown = false;
    this.#advise();
  }

  /** One first step at a time, on the board and on the page. */
  #advise(): void {
    const lead = this.simulated ? 'Look forward, and press F (in a headset: press A).' : 'Look forward, and press A.', means = this.simulated ? IN_EMULATOR : IN_HEADSET;
    this.facts.means = this.#isForwardKnown ? means : { ...means, lead, takeOver: lead, again: lead };
  }

  /** Every frame of the headset. @param cameras their images, drawn */
  update(frame: XRFrame | undefined, now: number, cameras: readonly CameraView[]): void {
    const { session } = this;
    if (!session || !frame) return;
    this.screens.visible = !this.facts.past;
    this.screens.update(cameras);
    this.#mouse?.update(this.stage.renderer.getPixelRatio() * this.stage.vrShare);
    this.#write(now);
    if (session.visibilityState !== 'visible') return;
    const space = this.stage.renderer.xr.getReferenceSpace();
    for (const source of session.inputSources) {
      if (!isController(source) || !this.#buttons.isNew(source, B)) continue;
      this.acts.stop();
      this.guide.used('stop');
    }
    this.guide.follow(this.stage.renderer.xr.getCamera());
    if (space) this.#point(session, frame, space, now);
    if (space && !this.facts.past) this.#use(session, frame, space, now);
    for (const source of session.inputSources) this.#buttons.note(source);
  }

  /** The controller that has this tool's hand now. */
  #has(tool: number): boolean { return this.hands[tool]!.source === 'headset'; }
  #leads({ handedness }: XRInputSource): boolean { return this.#grips.some((grip, tool) => grip.handedness === handedness && this.#has(tool)); }
  /** The tool that a controller moves. */
  #toolOf(handedness: XRHandedness): number {
    return toolOf(handedness === 'left' ? 'left' : 'right', this.facts.welcome?.robot, this.facts.state?.controls.yaw ?? 0, this.#swapped);
  }

  #use(session: XRSession, frame: XRFrame, space: XRReferenceSpace, now: number): void {
    for (const source of session.inputSources) {
      if (!isController(source)) continue;
      if (this.#buttons.began(source, STICK)) this.#pressStick();
      const pressed = this.#buttons.began(source, A), swaps = this.facts.hasTwo && source.handedness === 'left';
      if (pressed && swaps) this.#swap();
      if ((pressed && !swaps) || this.#wantsForward) this.#setForward(frame, space);
      if (this.#buttons.began(source, GRIP)) this.#grip(source);
      this.#scale(source.gamepad!.axes[3] ?? 0, now);
    }
    let pours = false;
    for (let tool = 0; tool < this.hands.length; ++tool) pours = this.#follow(tool, session, frame, space, now) || pours;
    this.#pour(pours);
  }

  /** Reports the pose of the controller that moves this tool, and closes its gripper. @returns its trigger pours */
  #follow(tool: number, session: XRSession, frame: XRFrame, space: XRReferenceSpace, now: number): boolean {
    const hand = this.hands[tool]!, grip = this.#grips[tool]!;
    if (!this.#has(tool)) return false;
    let leading: XRInputSource | undefined;
    for (const source of session.inputSources) if (isController(source) && source.handedness === grip.handedness) leading = source;
    const grips = this.facts.isGripper(tool); // then the trigger closes it and does not pour
    if (grips && leading) hand.gripper = leading.gamepad!.buttons[TRIGGER]?.value ?? 0;
    // The controller is switched off or put down: this is no release. The server gets a sample without a pose.
    if (!leading) this.#report(tool, null, 0, now);
    else if (!this.#buttons.isPressed(leading, GRIP)) hand.release('headset');
    else {
      const lead = (frame.predictedDisplayTime ?? 0) / 1000 - now;
      this.#report(tool, frame.getPose(leading.gripSpace!, space) ?? null, lead > 0 && lead < LEAD_MAX ? lead : 0, now);
      this.#pulse(tool, leading);
    }
    if (grips || !leading || !this.#has(tool)) return false;
    return this.#tiltAfter === null ? this.#buttons.began(leading, TRIGGER) : this.#buttons.isPressed(leading, TRIGGER);
  }

  /** Not while a hand is engaged: its arm would not change under it. */
  #swap(): void {
    const now = performance.now() / 1000;
    if (this.hands.some(({ source }) => source === 'headset')) return this.facts.hint('Release both grips to swap the hands.', now);
    this.#swapped = !this.#swapped;
    const [left, right] = this.#arms ?? [];
    this.facts.hint(`Swapped: the left hand moves ‘${left}’, the right hand ‘${right}’.`, now);
  }

  /** Names of the arms of the left and the right hand; null: there is one arm. */
  get #arms(): [string, string] | null {
    const names = this.facts.toolNames;
    return this.facts.hasTwo ? [names[this.#toolOf('left')]!, names[this.#toolOf('right')]!] : null;
  }

  /** A line for each hand: its arm, and how that is. */
  #armLines(): string[] {
    const { facts } = this;
    return (['left', 'right'] as const).map((side) => {
      const tool = this.#toolOf(side), wave = facts.wave(tool);
      return `${side === 'left' ? 'Left hand (X swaps)' : 'Right hand'}: ‘${facts.toolNames[tool]}’ ${facts.state?.tools[tool]?.state ?? ''}${wave ? `, ${waveText(wave)}` : ''}`;
    });
  }

  /** A pressed stick resets if a reset is due; otherwise it presses the item it chose. */
  #pressStick(): void {
    if (this.facts.mayReset) return this.acts.reset();
    this.board.items[this.board.chosen]?.act();
  }

  /** Rays and sticks on the board; the controller that moves the arm is not used there. */
  #point(session: XRSession, frame: XRFrame, space: XRReferenceSpace, now: number): void {
    this.#pointer.begin();
    for (const source of session.inputSources) {
      if (!isController(source) || this.#leads(source)) continue;
      const pose = frame.getPose(source.targetRaySpace, space);
      if (pose) this.#pointer.aim(source.handedness, pose, this.#buttons.isPressed(source, TRIGGER), this.#buttons.began(source, TRIGGER));
      this.#choose(source.gamepad!.axes[2] ?? 0, now);
    }
    const pressed = this.#pointer.end();
    if (this.#pointer.isUsed) this.guide.used('point');
    if (pressed >= 0) this.board.items[pressed]?.act();
  }

  #choose(stick: number, now: number): void {
    const { board } = this;
    if (Math.abs(stick) < 0.6 || now - this.#chooseAt < 0.3 || board.items.length === 0) return;
    this.#chooseAt = now;
    board.chosen = (board.chosen + (stick > 0 ? 1 : board.chosen < 0 ? 0 : -1) + board.items.length) % board.items.length;
    this.#wroteAt = 0;
    this.guide.used('stick');
  }

  #grip(source: XRInputSource): void {
    const tool = this.#toolOf(source.handedness), hand = this.hands[tool]!;
    if (hand.source !== null || !this.#isForwardKnown || this.#leads(source)) return;
    if (!hand.grab('headset', this.acts.wantLease())) return;
    this.#grips[tool]!.handedness = source.handedness;
    this.guide.used('lead');
  }

  /** From a pull of the trigger while engaged until it or the grip is released, the glass tilts with the hand. */
  #pour(wanted: boolean): void {
    const tilt = this.facts.state?.controls.tilt;
    if (wanted === (this.#tiltAfter !== null) || tilt === undefined) return;
    this.connection.send({ type: 'request', kind: 'tilt', value: this.#tiltAfter ?? Math.PI });
    this.#tiltAfter = wanted ? tilt : null;
  }

  #report(tool: number, pose: XRPose | null, lead: number, now: number): void {
    const grip = this.#grips[tool]!;
    grip.known = pose !== null;
    grip.guessed = pose !== null && pose.emulatedPosition;
    grip.lead = lead;
    grip.at = now;
    if (pose) {
      toRobot(pose.transform.position, grip.pose.p);
      toRobotRotation(pose.transform.orientation, grip.pose.q);
      this.leads.push(lead);
      if (this.leads.length > 600) this.leads.shift();
    }
    this.#tell(tool);
  }

  #tell(tool: number): void {
    const { pose, known, guessed, lead } = this.#grips[tool]!;
    this.hands[tool]!.report('headset', known ? pose : null, guessed, lead);
  }

  /** Between frames: an emulated hand keeps its pose, however slow the drawing is. A real one may be anywhere. */
  repeat(now: number): void {
    if (!this.simulated || !this.session) return;
    for (let tool = 0; tool < this.hands.length; ++tool) if (this.#has(tool) && now - this.#grips[tool]!.at >= 0.03) this.#tell(tool);
  }

  /** Takes control, and ends a playback: forward is that of the operator. */
  #setForward(frame: XRFrame, space: XRReferenceSpace): void {
    const viewer = frame.getViewerPose(space);
    this.#wantsForward = false;
    if (!viewer || !this.facts.mayTake) return;
    this.guide.used('forward');
    this.acts.wantLease();
    this.#remember();
    this.connection.send({ type: 'request', kind: 'yaw', value: -heading(toRobotRotation(viewer.transform.orientation)) });
    this.#isForwardKnown = true;
    this.#advise();
    if (!this.#isScaled) {
      this.connection.send({ type: 'request', kind: 'scale', value: 1 });
      this.facts.hint('Forward is where you look. Motion scale is now 1:1; the stick changes it.', performance.now() / 1000);
    }
    this.#isScaled = true;
  }

  #scale(stick: number, now: number): void {
    const scale = this.facts.state?.controls.scale;
    if (!scale || Math.abs(stick) < 0.5 || now - this.#scaleAt < 0.15) return;
    this.#scaleAt = now;
    this.#remember();
    const next = Math.min(2, Math.max(0.1, scale * (stick < 0 ? 1.1 : 1 / 1.1)));
    this.connection.send({ type: 'request', kind: 'scale', value: next });
    this.#isScaled = true;
    this.guide.used('stick');
  }

  /** When a limit begins to hold back the arm that the controller moves. */
  #pulse(tool: number, source: XRInputSource): void {
    const { state, welcome } = this.facts, grip = this.#grips[tool]!, constrained = state !== null && isLimitOf(tool, state.constraint, welcome?.robot);
    if (constrained && !grip.constrained) {
      const motor = (source.gamepad as unknown as { hapticActuators?: { pulse?(strength: number, ms: number): void }[] }).hapticActuators?.[0];
      motor?.pulse?.(0.6, 40);
    }
    grip.constrained = constrained;
  }

  readonly #asks: Asks = {
    command: (kind, more) => this.acts.command(kind, more),
    reset: () => this.acts.reset(),
    recentre: () => { this.#wantsForward = true; },
    swap: () => this.#swap(),
  };

  /** Warnings that the operator must see wherever they look. */
  #lost(live: boolean): string[] {
    if (!live) return ['No connection: the arm may move'];
    return this.#grips.flatMap(({ known, guessed, at, handedness }, tool) => {
      if (!this.#has(tool) || (known && !guessed) || at === Infinity) return [];
      return [this.facts.hasTwo ? `${handedness === 'left' ? 'Left' : 'Right'} controller not seen: the arms hold` : 'Controller not seen: the arm holds'];
    });
  }

  #write(now: number): void {
    const { facts } = this, { state } = facts;
    if (!state || now - this.#wroteAt < 0.2) return;
    this.#wroteAt = now;
    const live = facts.status === 'open' && !facts.isStale(now), present = live && !facts.past;
    const ms = (us: number | null) => latencyText(us === null ? null : us / 1000);
    const { p50, p99 } = state.latency_us, title = facts.title(now);
    const wave = present && !facts.hasTwo ? facts.wave() : null;
    this.guide.arms = this.#arms;
    this.board.write(
      title.charAt(0).toUpperCase() + title.slice(1),
      `#${(present ? STATE_COLORS[state.state] : STATE_COLORS.idle).toString(16).padStart(6, '0')}`,
      !live ? 'the view is outdated, the arm may move' : !present ? '' : `${facts.asked()} ${facts.askedUntil(now)}`.trim() || facts.constraint() || facts.spill() || (facts.wasRefilled(now) ? 'full glass again' : ''),
      [facts.reason(now),
        facts.advice(now, Math.max(...this.hands.map(({ heldFor }) => heldFor))),
        ...(present && facts.hasTwo ? this.#armLines() : []),
        present ? `Latency ${ms(p50)} ms, p99 ${ms(p99)} ms · scale ${scaleText(state.controls.scale)}` : '',
        wave ? waveText(wave) : ''],
      live ? itemsOf(facts, this.#asks) : []);
    this.guide.notice.say(this.#lost(live));
    this.screens.write();
    // Turns to the eye.
    this.stage.renderer.xr.getCamera().getWorldPosition(this.#eye);
    this.board.lookAt(this.#eye);
  }
}
