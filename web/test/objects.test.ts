import Ajv from 'ajv';
import * as THREE from 'three';
import { beforeEach, describe, expect, it, vi } from 'vitest';
import schema from '../protocol/schema.json';
import type { Connection } from '../src/connection';
import { Objects } from '../src/input/objects';
import type { CellObject, ClientMessage } from '../src/protocol';
import type { Stage } from '../src/scene/stage';
import { Surroundings } from '../src/scene/surroundings';
import type { Session } from '../src/session';

const at = (x: number, y: number, z: number): number[][] => [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]];
const box = (name: string, x: number, velocity: [number, number, number] = [0, 0, 0]): CellObject =>
  ({ name, shape: 'box', size: [0.2, 0.2, 0.2], rounding: 0, origin: at(x, 0, 0.1), velocity, margin: 0.01, color: '', holds_only_tool: false, attached: false });

const ajv = new Ajv();
ajv.addSchema(schema, 'protocol');
const isRequest = (message: unknown): boolean => ajv.validate('protocol#/definitions/client', message);

type Listener = (event: object) => void;
type Placed = { text: string; object: { p: [number, number, number] } | null };

/** A page of 400 by 300 whose camera looks down at the floor, the base's z up, from 1.5 m in front of it. */
class Page {
  readonly told: Placed[] = [];
  readonly surroundings = new Surroundings();
  readonly session = { mayTake: true, past: false, active: 0 };
  leases = 0;
  readonly objects: Objects;
  readonly #heard = new Map<string, Listener>();
  #at = 0;

  constructor(objects: CellObject[]) {
    const camera = new THREE.PerspectiveCamera(60, 4 / 3, 0.01, 100);
    camera.position.set(0, 1, 1.5);
    camera.lookAt(0, 0.1, 0);
    const base = new THREE.Group();
    base.rotation.x = -Math.PI / 2;
    base.add(this.surroundings);
    this.surroundings.setCell({ name: 'test', objects });
    for (const each of [camera, base]) each.updateMatrixWorld(true);
    const listen = (type: string, listener: Listener) => { this.#heard.set(type, listener); };
    vi.stubGlobal('addEventListener', listen);
    vi.spyOn(performance, 'now').mockImplementation(() => (this.#at += 1000));
    const canvas = { addEventListener: listen, getBoundingClientRect: () => ({ left: 0, top: 0, width: 400, height: 300 }) };
    this.objects = new Objects(
      { surroundings: this.surroundings, base, view: { camera, orbit: { enabled: true } } } as unknown as Stage,
      () => false, this.session as unknown as Session,
      { send: (message: ClientMessage) => { this.told.push(message as unknown as Placed); } } as unknown as Connection, canvas as unknown as HTMLCanvasElement, () => { ++this.leases; });
  }

  pointer(type: string, clientX: number, clientY: number, pointerId = 1): void {
    this.#heard.get(type)!({ clientX, clientY, pointerId, button: 0, stopPropagation: () => {} });
  }
  x(name: string): number { return this.surroundings.solid(name)!.position.x; }
}

describe('objects', () => {
  let page: Page;
  beforeEach(() => { page = new Page([box('box', 0)]); });

  it('are told where they are dragged', () => {
    page.pointer('pointerdown', 200, 150);
    page.pointer('pointermove', 240, 150);
    page.objects.draw();
    expect(page.told.map(({ text }) => text)).toEqual(['box']);
    expect(page.told[0]!.object!.p[0]).toBeGreaterThan(0.1);
    expect(page.told[0]!.object!.p[2]).toBeCloseTo(0.1, 9);
    expect(page.leases).toBe(1);
    expect(page.x('box')).toBe(page.told[0]!.object!.p[0]);
  });

  it('are framed with the post they stand on, planes are not', () => {
    const around = new Surroundings(), all = new THREE.Box3();
    const floor = { ...box('floor', 0), shape: 'half_space' } as CellObject, added = { ...box('box 1', 0), origin: at(0, 0, 0.4) };
    around.setCell({ name: 'test', objects: [floor, added] });
    around.bound(all);
    expect(all.max.z).toBeCloseTo(0.51, 6); // with its margin
    expect(all.min.z).toBeLessThan(around.floor + 0.01);
    expect(all.max.x).toBeLessThan(1);
  });

  it('are told by what the server takes, whatever else it tells of them', () => {
    page.surroundings.setCell({ name: 'test', objects: [Object.assign(box('box', 0), { may_be_touched_by: [], news: 1 })] });
    page.pointer('pointerdown', 200, 150);
    page.pointer('pointermove', 240, 150);
    page.objects.draw();
    expect(isRequest(page.told[0])).toBe(true);
  });

  it('stay in the cell when the pointer is at the horizon, where nobody would find them again', () => {
    page.pointer('pointerdown', 200, 150);
    for (let y = 150; y > 0; y -= 0.125) {
      page.pointer('pointermove', 200, y);
      page.objects.draw();
    }
    const far = page.told.map(({ object }) => Math.hypot(...object!.p));
    expect(Math.max(...far)).toBeLessThan(2.1);
    expect(Math.max(...far)).toBeGreaterThan(1.9);
  });

  it('are chosen for the buttons by being dragged', () => {
    expect(page.objects.chosen).toBe('');
    page.pointer('pointerdown', 200, 150);
    page.pointer('pointerup', 200, 150);
    expect(page.objects.chosen).not.toBe('');
    page.surroundings.setCell({ name: 'test', objects: [] });
    expect(page.objects.chosen).toBe('');
  });

  it.each(['mayTake', 'past'] as const)('stand where the server has them when the arm is no longer ours: %s', (fact) => {
    page.pointer('pointerdown', 200, 150);
    page.pointer('pointermove', 240, 150);
    page.objects.draw();
    const told = page.told.length;
    page.session[fact] = fact === 'past';
    page.pointer('pointermove', 280, 150);
    page.objects.draw();
    page.pointer('pointerup', 280, 150);
    page.objects.addBox();
    page.objects.remove();
    expect(page.told.length).toBe(told);
    expect(page.x('box')).toBe(0);
  });

  it('that were added stand on the floor, as far as one sees', () => {
    page.surroundings.floor = -0.6;
    page.surroundings.setCell({ name: 'test', objects: [box('box 1', 0), box('machine', 1), { ...box('box 2', 2), attached: true }] });
    const lowest = (name: string): number => new THREE.Box3().setFromObject(page.surroundings.solid(name)!).min.y; // the base's z is up
    page.surroundings.updateWorldMatrix(true, true);
    expect(lowest('box 1')).toBeCloseTo(-0.6, 2);
    expect(lowest('machine')).toBeGreaterThan(-0.05);
  });

  it('are held by one finger: another does not take them along', () => {
    page.pointer('pointerdown', 200, 150, 1);
    page.pointer('pointermove', 210, 150, 1);
    page.objects.draw();
    const { x } = page.surroundings.solid('box')!.position;
    page.pointer('pointerdown', 300, 200, 2);
    page.pointer('pointermove', 330, 200, 2);
    page.objects.draw();
    expect(page.x('box')).toBe(x);
    page.pointer('pointerup', 330, 200, 2);
    page.pointer('pointermove', 220, 150, 1);
    page.objects.draw();
    expect(page.x('box')).toBeGreaterThan(x);
  });

  it('that go while they are dragged are not brought back', () => {
    page.pointer('pointerdown', 200, 150);
    page.surroundings.setCell({ name: 'test', objects: [] });
    page.pointer('pointermove', 240, 150);
    page.objects.draw();
    page.pointer('pointerup', 240, 150);
    expect(page.told).toEqual([]);
  });

  it('that move by themselves go on, from where they were when the cell was told', () => {
    page.surroundings.setCell({ name: 'test', at_s: 100, objects: [box('ball', 0, [0.5, 0, 0]), box('box', 1)] });
    page.surroundings.goOn(104, [{ pose: { p: [0, 0, 0], q: [0, 0, 0, 1] } }]);
    expect([page.x('ball'), page.x('box')]).toEqual([2, 1]);
  });

  it('that the tool carries go with it, and cannot be dragged', () => {
    page.surroundings.setCell({ name: 'test', objects: [{ ...box('box', 0.5), attached: true }] });
    page.surroundings.goOn(1, [{ pose: { p: [0.2, 0, 0], q: [0, 0, 1, 0] } }]);  // turned by half a turn about z
    expect(page.x('box')).toBeCloseTo(-0.3);
    page.surroundings.goOn(1, [{ pose: { p: [-0.5, 0, 0], q: [0, 0, 0, 1] } }]);
    expect(page.x('box')).toBeCloseTo(0);
    page.pointer('pointerdown', 200, 150);
    page.pointer('pointermove', 240, 150);
    page.objects.draw();
    page.pointer('pointerup', 240, 150);
    expect(page.told).toEqual([]);
  });

  it('are taken by the tool and let go of: the last one dragged, or what it has', () => {
    page.objects.carry();
    expect(page.told).toEqual([]);
    page.pointer('pointerdown', 200, 150);
    page.pointer('pointerup', 200, 150);
    page.objects.carry();
    page.surroundings.setCell({ name: 'test', objects: [{ ...box('bottle', 0.5), attached: true }] });
    page.objects.carry();
    expect(page.told).toMatchObject([{ kind: 'attach', text: 'box' }, { kind: 'detach', text: 'bottle' }]);
  });

  it('are taken by the active tool, and move with the tool that has them', () => {
    page.pointer('pointerdown', 200, 150);
    page.pointer('pointerup', 200, 150);
    page.session.active = 1;
    page.objects.carry();
    page.surroundings.setCell({ name: 'test', objects: [{ ...box('box', 0.5), attached: true, tool: 1 }, box('other', 0)] });
    page.surroundings.goOn(1, [0, 1].map((x) => ({ pose: { p: [x, 0, 0] as const, q: [0, 0, 0, 1] as const } })));
    expect([page.x('box'), page.objects.carries]).toEqual([1.5, true]);
    page.session.active = 0;
    expect(page.objects.carries).toBe(false);
    page.session.active = 1;
    page.objects.carry();
    expect(page.told).toEqual([{ type: 'request', kind: 'attach', text: 'box', tool: 1 }, { type: 'request', kind: 'detach', text: 'box' }]);
  });

  it('have whatever name their file gave them', () => {
    const names = ['__proto__', 'constructor', '<b>x</b>', 'toString'];
    page.surroundings.setCell({ name: 'test', objects: names.map((name, i) => box(name, i)) });
    expect(names.map((name) => page.x(name))).toEqual([0, 1, 2, 3]);
    page.surroundings.touch(3);
    page.surroundings.setCell({ name: 'test', objects: [] });
    page.surroundings.touch(2);
    expect(page.surroundings.objects).toEqual([]);
  });
});
