import { clock, scaleText } from '../figures';
import { element } from '../element';
import { isTyped } from '../input/shortcuts';
import type { Profile } from '../protocol';
import { waveOf, waveText } from '../session';
import { keptCurves, showChoice, type Curve, type Joint } from './curves';
import { fine, Happened, spillAt } from './happened';
import type { Player } from './player';
import { PRESSED, Track, type Span } from './track';

/** Speeds selected in turn by the button. */
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];

/**
 * A recording that is shown: its time line with buttons and keys, its events and its plots. On the page and in a
 * report.
 */
export class Replay {
  player: Player | null = null;
  /** Laid over the player's recording, aligned at the first engagement. */
  other: Player | null = null;
  profiles: readonly Profile[] = [];
  /** Of the arm, for their names. */
  joints: readonly Joint[] = [];
  /** mm, height of the glass inside; 0: no glass. */
  rim = 0;
  #track: Track | null = null;
  /** Plots that are drawn. */
  readonly #chosen: Set<Curve>;
  readonly #happened: Happened;

  /**
   * @param address of a recording by its name: the start of links to times
   * @param onLook another interval is shown
   * @param more plots that are drawn by default
   */
  constructor(address: (name: string) => string, private readonly onLook: (span: Span) => void = () => {}, more: readonly Curve[] = []) {
    this.#chosen = keptCurves(more);
    this.#happened = new Happened(element('past-events', HTMLOListElement), element('past-kinds', HTMLParagraphElement), address);
    const press = (id: string, act: () => void): void => { element(id, HTMLButtonElement).onclick = act; };
    press('past-play', () => this.player?.toggle());
    press('past-back', () => this.player?.step(-1));
    press('past-on', () => this.player?.step(1));
    press('past-speed', () => { if (this.player) this.player.speed = SPEEDS[(SPEEDS.indexOf(this.player.speed) + 1) % SPEEDS.length]!; });
    press('past-loop', () => { if (this.player) this.player.loops = !this.player.loops; });
    press('past-longer', () => this.#track?.zoom(PRESSED));
    press('past-closer', () => this.#track?.zoom(1 / PRESSED));
    press('past-whole', () => this.#track?.zoom(Infinity));
    const range = element('past-at', HTMLInputElement);
    range.oninput = () => {
      if (!this.player) return;
      this.player.playing = false;
      this.player.seek(Number(range.value));
    };
    // Used while a recording is shown: the keys that move the arm are off then, and none of them is used here.
    const keys: Readonly<Record<string, () => void>> = {
      p: () => this.player?.toggle(), ',': () => this.player?.step(-1), '.': () => this.player?.step(1),
      arrowleft: () => this.player?.step(-1), arrowright: () => this.player?.step(1),
      '+': () => this.#track?.zoom(1 / PRESSED), '=': () => this.#track?.zoom(1 / PRESSED), '-': () => this.#track?.zoom(PRESSED), 0: () => this.#track?.zoom(Infinity),
    };
    addEventListener('keydown', (event) => {
      if (!this.player || event.ctrlKey || event.altKey || event.metaKey || isTyped(event.target) || event.target instanceof HTMLSelectElement) return;
      const key = event.key.toLowerCase(), { target } = event;
      if (key.startsWith('arrow') && (target instanceof HTMLInputElement || (target instanceof HTMLElement && target.role === 'tab'))) return; // arrows are theirs
      if (!Object.hasOwn(keys, key) || (key === 'p' && event.repeat)) return;
      event.preventDefault();
      keys[key]!();
    });
    showChoice(element('past-plots', HTMLElement), this.#chosen, () => this.repaint());
  }

  /** Shows it from its start. */
  open(player: Player): void {
    this.player = player;
    element('past-at', HTMLInputElement).max = String(player.duration);
    this.#happened.show(player);
    this.lay(null);
  }

  /** Lays another recording over it; null: none. */
  lay(other: Player | null): void {
    this.other = other;
    this.repaint();
  }

  /** Also after a change of theme. */
  repaint(): void {
    const { player, other } = this;
    if (!player) return;
    const span = this.#track?.player === player ? this.#track.span : null;
    this.#track = new Track(element('track', HTMLDivElement), player, this.profiles, other, other ? other.firstGrip - player.firstGrip : 0, this.#chosen, this.joints, this.onLook);
    if (span) this.#track.look(span); // keeps the zoom
  }

  close(): void { this.player = this.other = this.#track = null; }

  look(span: Span): void { this.#track?.look(span); }

  /** Every frame. @param dt s */
  advance(dt: number): void {
    this.player?.advance(dt);
    if (this.player) this.other?.seek(this.player.at + this.other.firstGrip - this.player.firstGrip);
  }

  /** A few times a second. */
  draw(): void {
    const { player } = this;
    if (!player) return;
    const { at, duration, playing, speed, loops } = player, label = this.profiles.find(({ name }) => name === player.profile)?.label ?? player.profile;
    element('past-at', HTMLInputElement).value = String(at);
    const facts = [player.state, label, player.scale && `scale ${scaleText(player.scale)}`, this.#track?.values(), ...player.tools.map((tool) => this.#liquid(tool))].filter(Boolean);
    element('past-at', HTMLInputElement).setAttribute('aria-valuetext', [`${clock(at)} of ${clock(duration)}`, ...facts].join(', '));
    element('past-time', HTMLElement).textContent = `${fine(at, playing ? 1 : 2)} / ${clock(duration)}`; // a step is less than a tenth
    element('past-play', HTMLButtonElement).textContent = playing ? 'Pause' : 'Play';
    element('past-speed', HTMLButtonElement).textContent = `${speed} ×`;
    element('past-loop', HTMLButtonElement).setAttribute('aria-pressed', String(loops));
    const line = element('past-facts', HTMLElement);
    line.textContent = line.title = facts.join(' · '); // the text may be cut next to another recording
    element('past-spill', HTMLElement).textContent = spillAt(player.motion.events ?? [], player.now);
    this.#happened.follow(at);
    this.#track?.draw();
  }

  /** Of a tool, with its name if there are two. */
  #liquid(tool: Player): string {
    const words = tool.spilled ? 'spilled' : this.#wave(tool);
    return words && tool.motion.tool !== undefined ? `${tool.motion.tool}: ${words}` : words;
  }

  #wave(player: Player): string {
    const left = this.rim > 0 && player.fill > 0 ? player.freeboard() : null, wave = left && waveOf(this.rim - 1000 * player.fill, left.now, left.least);
    return wave ? waveText(wave) : '';
  }
}
