import { expect, it } from 'vitest';
import { busyWords } from '../src/busy';

it('tells whoever waits for long, for how long by now', () => {
  expect(busyWords('Reading…', 0)).toBe('Reading…');
  expect(busyWords('Reading…', 1)).toBe('Reading…');
  expect(busyWords('Reading…', 12)).toBe('Reading… 12 s');
});
