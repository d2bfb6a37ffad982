import * as THREE from 'three';
import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import type { Robot } from '../src/descriptions';
import { chainOf } from '../src/descriptions';
import { Hand } from '../src/hand';
import { Gamepads, Keys } from '../src/input/keys';
import { isLimitOf, toolOf } from '../src/input/sides';
import { itemsOf } from '../src/input/menu';
import type { ClientMessage, ServerMessage, StateMessage, Tool } from '../src/protocol';
import { Arm } from '../src/scene/arm';
import { Session } from '../src/session';
import { server } from './server_messages';

const at = (x: number, y: number): number[][] => [[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, 0], [0, 0, 0, 1]];
const joint = (origin: number[][], parent?: number) => ({ name: 'j', origin, axis: [0, 0, 1] as const, ...(parent !== undefined && { parent }) });
/** A trunk, and two arms of two joints; the first is at y of the base. */
const robot = (names: [string, string], y: number): Robot => ({
  name: 'two', home: [], pairs: [],
  joints: [joint(at(0, 0)), joint(at(0, y)), joint(at(0.3, 0)), joint(at(0, -y), 1), joint(at(0.3, 0))],
  tools: [{ name: names[0], link: 3, origin: at(0, 0) }, { name: names[1], link: 5, origin: at(0, 0) }],
  bodies: [0, 3, 5].map((link) => ({ name: `b${link}`, link, origin: at(0, 0), shape: 'sphere', radius: 0.1 })),
});
const shape = robot(['left', 'right'], 0.4);

describe('two arms', () => {
  it('have the joints on the ways to their tools', () => {
    expect([chainOf(shape, 0), chainOf(shape, 1)]).toEqual([[0, 1, 2], [0, 3, 4]]);
  });

  it('are drawn where their joints are, also on a trunk that slides', () => {
    const lift = { ...shape.joints[0]!, type: 'prismatic' as const }, arm = new Arm({ ...shape, joints: [lift, ...shape.joints.slice(1)] }, { radius: 0.03, height: 0.1, fill: 0.05 });
    arm.pose([0.2, Math.PI / 2, 0, 0, 0]);
    arm.updateMatrixWorld(true);
    const places = arm.tools.map((tool) => tool.getWorldPosition(new THREE.Vector3()).toArray().map((x) => Math.round(1e6 * x) / 1e6 + 0));
    expect(places).toEqual([[0, 0.7, 0.2], [0.3, -0.4, 0.2]]);
  });

  it('follow the hands of their names, and otherwise those that the operator sees at their side', () => {
    for (const yaw of [0, Math.PI]) expect([toolOf('left', robot(['right_arm', 'Left'], 0.4), yaw), toolOf('right', shape, yaw)]).toEqual([1, 1]);
    const unnamed = robot(['a', 'b'], 0.4), mirrored = robot(['a', 'b'], -0.4);
    expect([toolOf('left', unnamed, 0), toolOf('right', unnamed, 0), toolOf('left', mirrored, 0)]).toEqual([0, 1, 1]);
    expect([toolOf('left', unnamed, Math.PI), toolOf('left', mirrored, 3)]).toEqual([1, 0]); // from the other side
    expect([toolOf('left', shape, 0, true), toolOf('right', shape, 0, true)]).toEqual([1, 0]);
    expect([toolOf('left', null, 0), toolOf('right', { ...shape, tools: [shape.tools[0]!] }, 0, true)]).toEqual([0, 0]);
  });

  it('have the limits of their joints and bodies', () => {
    const felt = (kind: 'velocity' | 'self_collision' | 'obstacle' | 'reach' | 'none', first: number, second = -1) => [0, 1].map((tool) => isLimitOf(tool, { kind, first, second }, shape));
    expect([felt('velocity', 2), felt('velocity', 4), felt('velocity', 0)]).toEqual([[true, false], [false, true], [true, true]]);
    expect([felt('self_collision', 1, 2), felt('obstacle', 2), felt('reach', -1), felt('none', -1)]).toEqual([[true, true], [false, true], [true, true], [false, false]]);
  });
});

describe('two hands', () => {
  let sent: Extract<ClientMessage, { type: 'sample' }>[] = [], pads: unknown[] = [], press: (event: object) => void = () => {};
  const make = () => {
    const count = { sequence: 0 };
    return [0, 1].map((tool) => new Hand({ send: (message) => sent.push(structuredClone(message) as (typeof sent)[number]) > 0 }, () => performance.now() / 1000, () => true, tool, count));
  };
  const session = (): Session => Object.assign(new Session(), { welcome: { robot: shape }, state: { controls: { scale: 1, yaw: 0 } } });
  beforeEach(() => {
    sent = [];
    vi.stubGlobal('HTMLInputElement', class {});
    vi.stubGlobal('addEventListener', (type: string, act: typeof press) => { if (type === 'keydown') press = act; });
    vi.stubGlobal('navigator', { getGamepads: () => pads });
  });
  afterEach(() => { vi.unstubAllGlobals(); });

  it('count their samples together, and each says its tool; the first needs not', () => {
    const [first, second] = make() as [Hand, Hand];
    first.grab('drag');
    second.grab('keys');
    first.lead('drag', [0, 0, 0], [0, 0, 0, 1], 1, 0);
    second.release('keys');
    expect(sent.map(({ sequence, tool, clutch }) => [sequence, tool, clutch])).toEqual([[1, undefined, false], [2, 1, false], [3, undefined, true], [4, 1, false]]);
  });

  it('are moved by keys one at a time: a held key keeps its hand when the other becomes active', () => {
    const hands = make(), of = session(), keys = new Keys(() => hands[of.active]!, of, () => false, () => 0);
    const key = (code: string) => press({ target: null, code, timeStamp: 0, preventDefault: () => {} });
    key('KeyW');
    of.active = 1;
    keys.update(0.01);
    expect([hands[0]!.source, hands[1]!.source, sent.every(({ tool }) => tool === undefined)]).toEqual(['keys', null, true]);
  });

  it('are moved by a gamepad at once, each by its bumper, stick and trigger', () => {
    const hands = make(), of = session(), gripped: [number, number][] = [];
    const plug = (axes: number[], ...down: number[]) => { pads = [{ mapping: 'standard', timestamp: performance.now(), axes, buttons: Array.from({ length: 17 }, (_, i) => ({ value: Number(down.includes(i)), pressed: down.includes(i) })) }]; };
    plug([0, 0, 0, 0]);
    const gamepad = new Gamepads(hands, of, () => false, () => 0, () => {}, (closed, tool) => { gripped.push([closed, tool]); }, () => performance.now() / 1000);
    gamepad.update(0.01);
    plug([0, -1, 1, 0], 4);
    gamepad.update(0.1);
    expect([hands[0]!.clutch, hands[1]!.clutch]).toEqual([true, false]);
    plug([0, -1, 1, 0], 4, 5, 3, 7);
    gamepad.update(0.1);
    const [left, right] = [undefined, 1].map((wanted) => sent.filter(({ tool }) => tool === wanted).at(-1)!);
    expect([left!.p[0], left!.p[1], right!.p[1], right!.p[2]]).toEqual([expect.closeTo(0.05), 0, expect.closeTo(-0.025), expect.closeTo(1.025)]);
    expect(gripped).toEqual([[1, 1]]);
  });

  it('have two glasses, of which each spills for itself; the headset offers to swap the hands', () => {
    const of = new Session(), example = server.state as StateMessage;
    const tool = (spilled: boolean): Tool => ({ ...example.tools[0]!, state: 'ready', liquid: { ...example.tools[0]!.liquid, spilled, spilled_share: spilled ? 0.25 : 0, freeboard: 0.05, least_freeboard: 0.04 } });
    of.connectionBecame('open');
    of.take({ ...server.welcome!, robot: shape } as ServerMessage, 0);
    of.paired = of.yours = true;
    for (const spilled of [false, true]) of.take({ ...example, state: 'ready', tools: [tool(false), tool(spilled)] }, 1);
    expect(of.spill()).toMatch(/^right: Spilled 25\.0 % of this glass/);
    expect([of.wave(0) === null, of.wave(1)]).toEqual([false, null]);
    const asked: string[] = [], asks = { command: () => {}, reset: () => {}, recentre: () => {}, swap: () => { asked.push('swap'); } };
    itemsOf(of, asks).find(({ label }) => label === 'Swap hands')!.act();
    of.take({ ...server.welcome!, robot: { ...shape, tools: [shape.tools[0]] } } as ServerMessage, 2);
    expect([asked, itemsOf(of, asks).some(({ label }) => label === 'Swap hands')]).toEqual([['swap'], false]);
  });
});
