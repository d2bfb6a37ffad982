import { expect, it } from 'vitest';
import { Swing } from '../src/swing';

it('knows by whose motion the liquid swings', () => {
  const swing = new Swing();
  expect(swing.of(0, 2, true)).toBe(2); // no profile before
  expect(swing.of(5, 0, false)).toBe(0);
  expect(swing.of(6, 2, true)).toBe(0); // takes it over swinging
  expect(swing.of(6.9, 2, true)).toBe(0);
  expect(swing.of(7.1, 2, true)).toBe(2);
  expect(swing.of(8, 0, false)).toBe(0); // promises nothing
  expect(swing.of(9, 2, true)).toBe(0);
  expect(swing.of(1, 2, true)).toBe(2); // another session's clock
});
