import * as THREE from 'three';
import type { Hand } from '../hand';
import { heading, toRobot, toRobotRotation } from '../frames';
import type { Connection } from '../connection';
import type { Session } from '../session';
import { STATE_COLORS, type Stage } from '../scene/stage';

/** Buttons of the `xr-standard` mapping. */
const GRIP = 1, A = 4, B = 5;

/** The state as a board beside the arm, readable in the headset. Drawn anew only when its words change. */
class Board extends THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial> {
  readonly #context: CanvasRenderingContext2D;
  #shown = '';

  constructor() {
    const canvas = document.createElement('canvas');
    canvas.width = 1024;
    canvas.height = 384;
    super(new THREE.PlaneGeometry(0.8, 0.3), new THREE.MeshBasicMaterial({ map: new THREE.CanvasTexture(canvas), transparent: true }));
    this.#context = canvas.getContext('2d')!;
  }

  write(title: string, color: string, lines: string[]): void {
    const text = [title, ...lines].join('\n');
    if (text === this.#shown) return;
    this.#shown = text;
    const c = this.#context;
    c.clearRect(0, 0, 1024, 384);
    c.fillStyle = 'rgba(18, 22, 27, 0.88)';
    c.beginPath();
    c.roundRect(0, 0, 1024, 384, 40);
    c.fill();
    c.fillStyle = color;
    c.fillRect(0, 40, 18, 304);
    c.font = '600 76px system-ui, sans-serif';
    c.fillText(title, 60, 110);
    c.fillStyle = '#e4e8ee';
    c.font = '44px system-ui, sans-serif';
    lines.forEach((line, i) => c.fillText(line, 60, 190 + 62 * i, 920));
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
  #held: readonly boolean[] = [];
  #scaleAt = 0;
  #constraint = '';
  readonly #quaternion = new THREE.Quaternion();

  constructor(private readonly stage: Stage, private readonly hand: Hand, private readonly facts: Session,
              private readonly connection: Connection, private readonly wantLease: () => void, private readonly onStop: () => void,
              private readonly onChange: () => void) {
    this.#board.position.set(-0.75, 1.5, -1.2);
    this.#board.rotation.y = 0.45;
    this.#rig.add(this.#board);
    this.#rig.visible = false;
    stage.scene.add(this.#rig);
    for (const index of [0, 1]) {
      const grip = stage.renderer.xr.getControllerGrip(index);
      const body = new THREE.Mesh(new THREE.CapsuleGeometry(0.018, 0.09, 6, 16), new THREE.MeshStandardMaterial({ color: 0xf0f3f6, roughness: 0.4 }));
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
    device.position.set(0, 1.6, 0.25);
    device.controllers.right?.position.set(0.2, 1.25, -0.15);
    device.controllers.left?.position.set(-0.2, 1.25, -0.15);
    this.simulated = true;
    Object.assign(window, { emulatedHeadset: device });
  }

  async enter(mode: 'immersive-vr' | 'immersive-ar'): Promise<void> {
    const session = await navigator.xr!.requestSession(mode, { optionalFeatures: ['local-floor', 'hand-tracking'] });
    this.session = session;
    session.addEventListener('end', () => {
      this.session = null;
      this.#rig.visible = false;
      this.stage.showRoom(true);
      this.hand.release('headset');
      this.onChange();
    });
    await this.stage.renderer.xr.setSession(session);
    this.stage.showRoom(mode === 'immersive-vr');
    this.#rig.visible = true;
    this.#held = [];
    this.onChange();
  }

  /** Every frame of the headset. */
  update(frame: XRFrame | undefined, now: number): void {
    if (!this.session || !frame) return;
    const space = this.stage.renderer.xr.getReferenceSpace();
    const source = this.#source();
    this.#write();
    if (!space || !source?.gamepad || !source.gripSpace) return this.#noController();
    const pressed = source.gamepad.buttons.map((button) => button.pressed);
    const fresh = (button: number): boolean => pressed[button] === true && this.#held[button] !== true;
    const pose = frame.getPose(source.gripSpace, space);
    if (fresh(B)) this.onStop();
    if (fresh(A)) this.#setForward(frame, space);
    this.#scale(source.gamepad.axes[3] ?? 0, now);
    const gripped = pressed[GRIP] === true;
    if (fresh(GRIP)) this.wantLease();
    if (gripped || this.hand.source === 'headset') this.hand.grab('headset');
    if (this.hand.source === 'headset') {
      const known = pose && { p: toRobot(pose.transform.position), q: toRobotRotation(pose.transform.orientation) };
      this.hand.report('headset', known ?? null, gripped, known ? pose.emulatedPosition && !this.simulated : false);
      if (!gripped) this.hand.release('headset');
    }
    this.#held = pressed;
    this.#pulse(source);
  }

  /** The controller that grips, otherwise the right one. */
  #source(): XRInputSource | undefined {
    const all = [...(this.session?.inputSources ?? [])].filter((one) => one.gripSpace && one.gamepad);
    return all.find((one) => one.gamepad!.buttons[GRIP]?.pressed) ?? all.find((one) => one.handedness === 'right') ?? all[0];
  }

  #noController(): void {
    // Switched off, or put down: the server must hear that there is no pose rather than nothing.
    if (this.hand.source === 'headset') this.hand.report('headset', null, this.hand.clutch, false);
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
    const constraint = this.facts.constraint();
    if (constraint && !this.#constraint) {
      const motor = (source.gamepad as unknown as { hapticActuators?: { pulse?(strength: number, ms: number): void }[] }).hapticActuators?.[0];
      motor?.pulse?.(0.6, 40);
    }
    this.#constraint = constraint;
  }

  #write(): void {
    const state = this.facts.state;
    if (!state) return;
    const latency = state.latency_us.p50;
    this.#board.write(state.state, `#${STATE_COLORS[state.state].toString(16).padStart(6, '0')}`, [
      state.reason || (this.facts.yours ? 'grip: lead the arm · B: stop' : 'you are watching'),
      this.facts.constraint() || 'no limit active',
      `hand to command ${latency === null ? '–' : (latency / 1000).toFixed(0)} ms · scale ${state.controls.scale.toFixed(2)}`,
    ]);
    this.stage.camera.getWorldQuaternion(this.#quaternion);
  }
}
