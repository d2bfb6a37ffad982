import * as THREE from 'three';
import { describe, expect, it } from 'vitest';
import { Reach, type Followed } from '../src/input/reach';

const STEP = 0.01, LATE = 15, RAMP = 0.5;
type Seen = Followed & { now_s: number };

/** The server's target for the hand (Retargeter::update), sent so many steps late. */
class Server {
  now = 0;
  readonly target = new THREE.Vector3();
  readonly #news: Seen[] = [];
  readonly #hand = new THREE.Vector3();
  #engagedAt = NaN;

  step(hand: THREE.Vector3, follows: boolean): void {
    this.now += STEP;
    if (!follows) this.#engagedAt = NaN;
    else if (Number.isNaN(this.#engagedAt)) this.#engagedAt = this.now;
    else this.target.addScaledVector(hand.clone().sub(this.#hand), Math.min(1, (this.now - this.#engagedAt) / RAMP));
    this.#hand.copy(hand);
    this.#news.push({ now_s: 100 + this.now, state: follows ? 'engaged' : 'ready', leader: follows ? 'person' : null, target: { p: this.target.toArray(), q: [0, 0, 0, 1] } });
  }
  get told(): Seen { return this.#news[Math.max(0, Math.min(this.lastTold, this.#news.length - 1 - LATE))]!; }
  /** States after this one do not arrive. */
  lastTold = Infinity;
  /** From now on none arrives. */
  cut(): void { this.lastTold = this.#news.length - 1 - LATE; }
}

/** Drags for so many s to the position of `handle`. */
function drag(reach: Reach, server: Server, seconds: number, handle: (t: number) => THREE.Vector3, follows: (t: number) => boolean = () => true): void {
  for (let t = 0; t < seconds; t += STEP) {
    server.step(reach.shift, follows(t));
    reach.toward(handle(t), server.told, server.told.now_s, 0.5, server.now);
  }
}
const along = (x: number): THREE.Vector3 => new THREE.Vector3(x, 0, 0);

describe('a hand that leads to a handle', () => {
  it('brings the target there in a drag that is over before the grip follows all of its motion', () => {
    const reach = new Reach(), server = new Server();
    reach.begin(server.target, 0);
    drag(reach, server, 0.35, (t) => along(Math.min(0.1, t)));
    expect(server.target.x).toBeGreaterThan(0.09);
    expect(server.target.x).toBeLessThan(0.102);
    drag(reach, server, 1.2, () => along(0.1));
    expect(server.target.distanceTo(along(0.1))).toBeLessThan(1e-3);
  });
  it('brings it there also when the grip was lost on the way, and moves nothing meanwhile', () => {
    const reach = new Reach(), server = new Server();
    reach.begin(server.target, 0);
    drag(reach, server, 1, (t) => along(0.2 * t), (t) => t < 0.5);
    const was = server.target.x;
    drag(reach, server, 0.3, () => along(0.2), () => false);
    expect(server.target.x).toBe(was);
    drag(reach, server, 1.5, () => along(0.2));
    expect(server.target.distanceTo(along(0.2))).toBeLessThan(1e-3);
  });
  it('begins where the target is once the hand leads: somebody else had led it elsewhere', () => {
    const reach = new Reach(), server = new Server();
    reach.begin(along(0.05), 0);
    drag(reach, server, 1.5, () => along(0.15), (t) => t > 0.1);
    expect(server.target.distanceTo(along(0.15))).toBeLessThan(1e-3);
  });
  it('leads nowhere by old news', () => {
    const reach = new Reach(), server = new Server();
    reach.begin(server.target, 0);
    drag(reach, server, 0.8, (t) => along(0.1 * t));
    server.cut();
    drag(reach, server, 0.5, (t) => along(0.08 + 0.1 * t));
    drag(reach, server, 3, () => along(0.13));
    expect(server.target.distanceTo(along(0.13))).toBeLessThan(0.01);
  });
  it('takes no hand faster than what is taken for a jump', () => {
    const reach = new Reach(), server = new Server();
    reach.begin(server.target, 0);
    let before = 0, fastest = 0;
    drag(reach, server, 1, () => {
      fastest = Math.max(fastest, (reach.shift.x - before) / 0.5 / STEP);
      before = reach.shift.x;
      return along(0.5);
    });
    expect(fastest).toBeGreaterThan(1);
    expect(fastest).toBeLessThan(3.01);
  });
});
