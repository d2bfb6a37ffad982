import { describe, expect, it } from 'vitest';
import { B, Buttons, GRIP, isController } from '../src/input/controllers';

const TOUCH = ['meta-quest-touch-plus', 'generic-trigger-squeeze-thumbstick'];
const source = (pressed: number[] = [], { profiles = TOUCH, buttons = 7, hand = null as unknown, gripSpace = {} as unknown } = {}): XRInputSource =>
  ({ hand, gripSpace, profiles, gamepad: { buttons: Array.from({ length: buttons }, (_, i) => ({ pressed: pressed.includes(i) })) } }) as unknown as XRInputSource;
const set = (of: XRInputSource, button: number, pressed: boolean) => { (of.gamepad!.buttons[button] as { pressed: boolean }).pressed = pressed; };

describe('controllers', () => {
  it('are what an operator holds, never a hand that the headset sees', () => {
    expect(isController(source())).toBe(true);
    expect(isController(source([], { hand: new Map() }))).toBe(false);
    expect(isController(source([], { profiles: ['oculus-hand', 'generic-trigger'] }))).toBe(false);
    expect(isController(source([], { buttons: 1 }))).toBe(false);
    expect(isController(source([], { gripSpace: null }))).toBe(false);
  });

  it('have edges of their own', () => {
    const buttons = new Buttons(), left = source(), right = source();
    for (const each of [left, right]) buttons.note(each);
    set(left, B, true);
    expect([buttons.isNew(left, B), buttons.isNew(right, B)]).toEqual([true, false]);
    for (const each of [left, right]) buttons.note(each);
    set(right, B, true);
    expect([buttons.isNew(left, B), buttons.isNew(right, B)]).toEqual([false, true]);
  });

  it('that come with a button down stop the arm, but have gripped nothing', () => {
    const buttons = new Buttons(), late = source([GRIP, B]);
    expect([buttons.isNew(late, B), buttons.began(late, GRIP), buttons.isPressed(late, GRIP)]).toEqual([true, false, true]);
    buttons.note(late);
    expect([buttons.isNew(late, B), buttons.began(late, GRIP)]).toEqual([false, false]);
    set(late, GRIP, false);
    buttons.note(late);
    set(late, GRIP, true);
    expect(buttons.began(late, GRIP)).toBe(true);
  });

  it('must be opened after frames that nobody saw', () => {
    const buttons = new Buttons(), one = source();
    buttons.note(one);
    buttons.forget();
    set(one, GRIP, true);
    expect(buttons.began(one, GRIP)).toBe(false);
  });
});
