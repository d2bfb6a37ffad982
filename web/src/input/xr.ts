import * as THREE from 'three';
import type { Hand } from '../hand';
import { heading, toRobot, toRobotRotation, type MutablePose } from '../frames';
import type { Connection } from '../connection';
import type { Session } from '../session';
import { STATE_COLORS, type Stage } from '../scene/stage';
import { EmulatedHand } from './emulator';

/** Buttons of the `xr-standard` mapping. */
const GRIP = 1, A = 4, B = 5;

/** What the headset said last of the hand. */
interface Heard { readonly pose: MutablePose; known: boolean; gripped: boolean; guessed: boolean; at: number }

/** The state as a board beside the arm, readable in the headset. Drawn anew only when its words change. */
class Board extends THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial> {
  readonly #context: CanvasRenderingContext2D;
  #shown = '';

  constructor() {
    const canvas = document.createElement('canvas');
    canvas.width = 1024;
    canvas.height = 512;
    const map = new THREE.CanvasTexture(canvas);
    map.colorSpace = THREE.SRGBColorSpace;
    super(new THREE.PlaneGeometry(0.72, 0.36), new THREE.MeshBasicMaterial({ map, transparent: true, toneMapped: false }));
    this.#context = canvas.getContext('2d')!;
  }

  write(title: string, color: string, warning: string, lines: string[]): void {
    const text = [title, color, warning, ...lines].join('\n');
    if (text === this.#shown) return;
    this.#shown = text;
    const c = this.#context;
    c.clearRect(0, 0, 1024, 512);
    c.fillStyle = 'rgba(16, 20, 25, 0.9)';
    c.beginPath();
    c.roundRect(0, 0, 1024, 512, 44);
    c.fill();
    c.fillStyle = color;
    c.beginPath();
    c.arc(84, 88, 30, 0, 2 * Math.PI);
    c.fill();
    c.font = '650 84px system-ui, sans-serif';
    c.fillText(title, 142, 118);
    c.font = '44px system-ui, sans-serif';
    lines.forEach((line, i) => {
      c.fillStyle = i === 0 ? '#c4ccd6' : '#e8edf3';
      c.fillText(line, 56, 200 + 64 * i, 920);
    });
    if (warning) {
      c.fillStyle = '#e0a100';
      c.beginPath();
      c.roundRect(40, 412, 944, 76, 20);
      c.fill();
      c.fillStyle = '#1a1d21';
      c.font = '600 44px system-ui, sans-serif';
      c.fillText(`⚠ ${warning}`, 64, 464, 900);
    }
    this.material.map!.needsUpdate = true;
  }
}

/** A headset: the grip engages, thumbstick up and down scales, A sets forward, B stops. */
export class Headset {
  /** Its poses are exact though it calls them guesses: a headset that the page itself emulates. */
  simulated = false;
  session: XRSession | null = null;
  readonly #board = new Board();
  readonly #rig = new THREE.Group();
  readonly #controllers: THREE.Object3D[] = [];
  readonly #held: boolean[] = [];
  #scaleAt = 0;
  #constrained = false;
  #gripping: XRHandedness = 'none';
  #wroteAt = 0;
  readonly #eye = new THREE.Vector3();
  #mouse: EmulatedHand | null = null;
  readonly #last: Heard = { pose: { p: [0, 0, 1], q: [0, 0, 0, 1] }, known: false, gripped: false, guessed: false, at: Infinity };

  constructor(private readonly stage: Stage, private readonly hand: Hand, private readonly facts: Session,
              private readonly connection: Connection, private readonly wantLease: () => void, private readonly onStop: () => void,
              private readonly onChange: () => void) {
    this.#board.position.set(-0.55, 1.62, -1.2);
    this.#rig.add(this.#board);
    this.#rig.visible = false;
    stage.scene.add(this.#rig);
    for (const index of [0, 1]) {
      const grip = stage.renderer.xr.getControllerGrip(index);
      const body = new THREE.Mesh(new THREE.CapsuleGeometry(0.014, 0.07, 6, 16), new THREE.MeshStandardMaterial({ color: 0xf0f3f6, roughness: 0.4 }));
      body.rotation.x = -Math.PI / 3;
      grip.add(body);
      this.#controllers.push(grip);
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
    const { XRDevice, metaQuest3 } = await import('iwer');
    const device = new XRDevice(metaQuest3);
    device.installRuntime({ forceInstall: true } as never);
    device.position.set(-0.5, 1.55, -0.1);
    device.quaternion.set(-0.1, -0.17, -0.017, 0.98); // towards the arm
    device.controllers.right?.position.set(-0.18, 1.25, -0.6);
    device.controllers.left?.position.set(-0.62, 1.2, -0.5);
    this.simulated = true;
    this.#mouse = new EmulatedHand(device, this.stage.renderer.domElement);
    Object.assign(window, { emulatedHeadset: device });
  }

  async enter(mode: 'immersive-vr' | 'immersive-ar'): Promise<void> {
    const session = await navigator.xr!.requestSession(mode, { optionalFeatures: ['local-floor', 'hand-tracking'] });
    this.session = session;
    session.addEventListener('end', () => {
      this.session = null;
      this.#rig.visible = false;
      if (this.#mouse) this.#mouse.running = false;
      this.stage.present(null);
      this.hand.release('headset');
      this.onChange();
    });
    await this.stage.renderer.xr.setSession(session);
    this.stage.present(mode);
    this.#rig.visible = true;
    if (this.#mouse) this.#mouse.running = true;
    this.#held.length = 0;
    this.#last.at = Infinity;
    this.onChange();
  }

  /** Every frame of the headset. */
  update(frame: XRFrame | undefined, now: number): void {
    if (!this.session || !frame) return;
    this.#mouse?.fit(this.stage.renderer.getPixelRatio());
    const space = this.stage.renderer.xr.getReferenceSpace();
    const source = this.#source();
    this.#write(now);
    if (!space || !source?.gamepad || !source.gripSpace) return this.#noController(now);
    const { buttons } = source.gamepad;
    const pose = frame.getPose(source.gripSpace, space);
    if (this.#fresh(buttons, B)) this.onStop();
    if (this.#fresh(buttons, A)) this.#setForward(frame, space);
    this.#scale(source.gamepad.axes[3] ?? 0, now);
    const gripped = buttons[GRIP]?.pressed === true;
    if (this.#fresh(buttons, GRIP)) this.wantLease();
    if (gripped || this.hand.source === 'headset') this.hand.grab('headset');
    if (gripped) this.#gripping = source.handedness;
    if (this.hand.source === 'headset') {
      this.#report(pose ?? null, gripped, now);
      if (!gripped) this.hand.release('headset');
    }
    for (let i = 0; i < buttons.length; ++i) this.#held[i] = buttons[i]!.pressed;
    this.#pulse(source);
  }

  /** Whether it is pressed, and was not a frame ago. */
  #fresh(buttons: readonly GamepadButton[], button: number): boolean {
    return buttons[button]?.pressed === true && this.#held[button] !== true;
  }

  /** The controller that grips; otherwise the one that did, whose absence must not look like letting go; otherwise the right one. */
  #source(): XRInputSource | undefined {
    let best: XRInputSource | undefined;
    for (const one of this.session?.inputSources ?? []) {
      if (!one.gripSpace || !one.gamepad) continue;
      if (one.gamepad.buttons[GRIP]?.pressed) return one;
      if (this.hand.source === 'headset' && one.handedness !== this.#gripping) continue;
      if (!best || (one.handedness === 'right' && best.handedness !== 'right')) best = one;
    }
    return best;
  }

  #noController(now: number): void {
    // Switched off, or put down: the server must hear that there is no pose rather than nothing.
    if (this.hand.source === 'headset') this.#report(null, this.hand.clutch, now);
  }

  #report(pose: XRPose | null, gripped: boolean, now: number): void {
    const last = this.#last;
    last.known = pose !== null;
    last.gripped = gripped;
    last.guessed = pose !== null && pose.emulatedPosition && !this.simulated;
    last.at = now;
    if (pose) {
      toRobot(pose.transform.position, last.pose.p);
      toRobotRotation(pose.transform.orientation, last.pose.q);
    }
    this.#tell();
  }

  #tell(): void {
    const { pose, known, gripped, guessed } = this.#last;
    if (gripped) this.hand.report('headset', known ? pose : null, guessed);
  }

  /** Between frames: an emulated hand is where it was, however slowly its picture is drawn. A real one may be anywhere. */
  repeat(now: number): void {
    if (!this.simulated || !this.session || this.hand.source !== 'headset' || now - this.#last.at < 0.03) return;
    this.#tell();
  }

  #setForward(frame: XRFrame, space: XRReferenceSpace): void {
    const viewer = frame.getViewerPose(space);
    if (!viewer) return;
    this.connection.send({ type: 'request', kind: 'yaw', value: -heading(toRobotRotation(viewer.transform.orientation)) });
  }

  #scale(stick: number, now: number): void {
    const scale = this.facts.state?.controls.scale;
    if (!scale || Math.abs(stick) < 0.5 || now - this.#scaleAt < 0.15) return;
    this.#scaleAt = now;
    const next = Math.min(2, Math.max(0.1, scale * (stick < 0 ? 1.1 : 1 / 1.1)));
    this.connection.send({ type: 'request', kind: 'scale', value: next });
  }

  #pulse(source: XRInputSource): void {
    const constrained = (this.facts.state?.constraint.kind ?? 'none') !== 'none';
    if (constrained && !this.#constrained) {
      const motor = (source.gamepad as unknown as { hapticActuators?: { pulse?(strength: number, ms: number): void }[] }).hapticActuators?.[0];
      motor?.pulse?.(0.6, 40);
    }
    this.#constrained = constrained;
  }

  #write(now: number): void {
    const state = this.facts.state;
    if (!state || now - this.#wroteAt < 0.2) return;
    this.#wroteAt = now;
    const live = this.facts.status === 'open' && !this.facts.isStale(now);
    const ms = (us: number | null) => (us === null ? '–' : (us / 1000).toFixed(0));
    const { p50, p99 } = state.latency_us;
    this.#board.write(
      live ? state.state.charAt(0).toUpperCase() + state.state.slice(1) : this.facts.status === 'open' ? 'No news' : 'Not connected',
      `#${(live ? STATE_COLORS[state.state] : STATE_COLORS.idle).toString(16).padStart(6, '0')}`,
      !live ? 'nothing moves' : this.facts.constraint() || (state.liquid.spilled ? 'spilled' : ''),
      [live ? state.reason || this.facts.advice(now) : 'what you see is old',
        this.facts.yours ? 'Grip leads · stick scales · A forward · B stops' : this.facts.advice(now),
        `Latency ${ms(p50)} ms, p99 ${ms(p99)} ms · scale ${state.controls.scale.toFixed(2)}`]);
    // It turns to whoever looks.
    this.stage.renderer.xr.getCamera().getWorldPosition(this.#eye);
    this.#board.lookAt(this.#eye);
  }
}
