import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { Hand } from '../src/hand';
import { Trigger } from '../src/input/controllers';
import { Gamepads } from '../src/input/keys';
import type { Session } from '../src/session';

describe('a trigger', () => {
  it('says how far it is pulled, when it moves', () => {
    const trigger = new Trigger();
    expect([0, 0, 0.3, 0.305, 0.31, 0.5, 0.99, 1, 1, 0.001, 0].map((value) => trigger.moved(value)))
      .toEqual([null, null, 0.3, null, null, 0.5, 0.99, 1, null, 0.001, 0]);
  });

  it('that comes into sight half pulled has said nothing', () => {
    const trigger = new Trigger();
    expect([trigger.moved(0.5), trigger.moved(0.5), trigger.moved(0.8)]).toEqual([null, null, 0.8]);
    trigger.forget();
    expect([trigger.moved(0), trigger.moved(0), trigger.moved(1)]).toEqual([null, null, 1]);
  });
});

describe('a gamepad', () => {
  const BUMPER = 5, LEFT_TRIGGER = 6, RIGHT_TRIGGER = 7;
  let pads: unknown[] = [];
  let sent: { clutch: boolean; gripper?: number }[] = [];
  const plug = (buttons: Record<number, number> | null) => {
    pads = buttons === null ? [null] : [{
      mapping: 'standard', timestamp: performance.now(), axes: [0, 0, 0, 0],
      buttons: Array.from({ length: 17 }, (_, i) => ({ value: buttons[i] ?? 0, pressed: (buttons[i] ?? 0) > 0.5 })),
    }];
  };
  const make = () => {
    const session = { welcome: null, state: { controls: { scale: 1, yaw: 0 } } } as unknown as Session;
    const hand = new Hand({ send: (message) => sent.push(message as (typeof sent)[number]) > 0 }, () => performance.now() / 1000, () => true);
    return new Gamepads([hand], session, () => false, () => 0, () => {}, (closed) => { hand.gripper = closed; }, () => performance.now() / 1000);
  };

  beforeEach(() => {
    sent = [];
    plug({});
    vi.stubGlobal('addEventListener', () => {});
    vi.stubGlobal('navigator', { getGamepads: () => pads });
  });
  afterEach(() => { vi.unstubAllGlobals(); });

  it('closes the gripper by either trigger, in a grip of the hand or without one', () => {
    const gamepad = make();
    gamepad.update(0.01);
    expect(sent).toEqual([]);
    for (const [button, value] of [[RIGHT_TRIGGER, 0.6], [LEFT_TRIGGER, 1]] as const) {
      plug({ [button]: value });
      gamepad.update(0.01);
      expect(sent.at(-1)).toMatchObject({ clutch: false, gripper: value });
    }
    plug({ [BUMPER]: 1, [LEFT_TRIGGER]: 1 });
    gamepad.update(0.01);
    expect(sent.at(-1)).toMatchObject({ clutch: true, gripper: 1 });
    plug({ [BUMPER]: 1, [LEFT_TRIGGER]: 0.4 });
    gamepad.update(0.01);
    expect(sent.at(-1)).toMatchObject({ clutch: true, gripper: 0.4 });
  });

  it('that is lost and comes back leaves the gripper as it is', () => {
    const gamepad = make();
    gamepad.update(0.01);
    plug({ [RIGHT_TRIGGER]: 1 });
    gamepad.update(0.01);
    const before = sent.length;
    plug(null);
    gamepad.update(0.01);
    plug({});
    gamepad.update(0.01);
    gamepad.update(0.01);
    expect(sent.length).toBe(before);
    expect(sent.at(-1)!.gripper).toBe(1);
  });
});
