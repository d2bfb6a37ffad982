import { describe, expect, it } from 'vitest';
import type { ServerMessage } from '../src/protocol';
import { answersOf, DisplayDelay } from '../src/study';

const state = (now_s: number) => ({ type: 'state', now_s }) as ServerMessage;
const cell = { type: 'cell', cell: { name: 'none', objects: [] } } as ServerMessage;

describe('latency of the display', () => {
  it('holds states back, in their order, and nothing else', () => {
    const seen: ServerMessage[] = [];
    const delay = new DisplayDelay((message) => seen.push(message));
    delay.take(state(1), 1);
    expect(seen).toEqual([state(1)]);
    delay.seconds = 0.4;
    delay.take(state(2), 2);
    delay.take(cell, 2.1);
    delay.take(state(3), 2.2);
    expect(seen).toEqual([state(1), cell]);
    delay.release(2.39);
    expect(seen).toHaveLength(2);
    delay.release(2.4);
    delay.release(2.61);
    expect(seen.slice(2)).toEqual([state(2), state(3)]);
  });

  it('lets go of what waits when it ends', () => {
    const seen: ServerMessage[] = [];
    const delay = new DisplayDelay((message) => seen.push(message));
    delay.seconds = 0.2;
    delay.take(state(1), 1);
    delay.seconds = 0;
    delay.take(state(2), 1.01);
    expect(seen).toEqual([state(1), state(2)]);
  });
});

describe('questions', () => {
  it('offer every whole number of their scale', () => {
    expect(answersOf({ low: 0, high: 1 })).toEqual([0, 1]);
    expect(answersOf({ low: 0, high: 20 })).toHaveLength(21);
  });
});
