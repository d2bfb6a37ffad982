import { expect, it } from 'vitest';
import { episodeText, taskText } from '../src/episodes';

const task = { name: 'carry', instruction: 'Carry it.', time_limit: 30, conditions: ['glass at mark', 'nothing spilled'] };

it('tells what of a task is still to do, and how it ended', () => {
  expect(taskText(task, { time: 2.25, held: 0b10, spilled: 0, success: null })).toBe('2.3 of 30 s. 1 of 2 hold; to do: glass at mark. Spilled 0.0 %.');
  expect(taskText(task, { time: 9, held: 0b11, spilled: 0, success: true })).toBe('Done after 9.0 s. 2 of 2 hold. Spilled 0.0 %.');
  expect(taskText(task, { time: 30.1, held: 0b01, spilled: 0.25, success: false })).toBe('Time is over after 30.1 s. 1 of 2 hold. Spilled 25.0 %.');
});

it('waits for the first grip, and knows no spill of a gripper', () => {
  expect(taskText(task, { time: 0, held: 0b10, spilled: 0, success: null }, false)).toBe('30 s from Begin or from first engaging. 1 of 2 hold; to do: glass at mark.');
});

it('tells how the episodes stand', () => {
  expect(episodeText({ running: false, number: 0, time: 0, kept: 0, discarded: 0, lost: 0, success: null })).toBe('None yet.');
  expect(episodeText({ running: true, number: 3, time: 1.5, kept: 1, discarded: 1, lost: 0, success: null })).toBe('Episode 3 runs: 1.5 s. 1 kept, 1 discarded.');
  expect(episodeText({ running: false, number: 3, time: 4, kept: 2, discarded: 1, lost: 0, success: true })).toBe('Episode 3 ended after 4.0 s, a success. 2 kept, 1 discarded.');
  expect(episodeText({ running: false, number: 3, time: 4, kept: 1, discarded: 1, lost: 1, success: null })).toBe('Episode 3 ended after 4.0 s. 1 kept, 1 discarded, 1 lost: not recorded to the end.');
});
