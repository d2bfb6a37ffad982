import { describe, expect, it } from 'vitest';
import { clock, figures, Player, type Motion } from '../src/recordings';

const motion: Motion = { name: 'a', t_s: [5, 5.1, 5.3], q: [[0, 1], [1, 1], [1, -1]] };

describe('player', () => {
  it('is where the arm was, in between too, whichever way it seeks', () => {
    const player = new Player(motion);
    const at = (t: number) => { player.seek(t); return [...player.q()]; };
    expect(at(0)).toEqual([0, 1]);
    expect(at(0.05)[0]).toBeCloseTo(0.5);
    expect(at(0.2)[1]).toBeCloseTo(0);
    expect(at(9)).toEqual([1, -1]);
    expect(at(0.025)[0]).toBeCloseTo(0.25);
  });

  it('stops at its end and begins anew', () => {
    const player = new Player(motion);
    player.advance(0.2);
    expect(player.at).toBeCloseTo(0.2);
    player.advance(5);
    expect([player.at, player.playing]).toEqual([player.duration, false]);
    player.toggle();
    expect([player.at, player.playing]).toEqual([0, true]);
  });

  it('stands still when paused', () => {
    const player = new Player(motion);
    player.toggle();
    player.advance(0.1);
    expect(player.at).toBe(0);
  });

  it('takes a single look, and refuses none', () => {
    expect([...new Player({ name: 'b', t_s: [3], q: [[0.5]] }).q()]).toEqual([0.5]);
    expect(() => new Player({ name: 'c', t_s: [], q: [] })).toThrow('c holds no motion');
  });
});

describe('list', () => {
  it('says length and figures, and what is missing it leaves out', () => {
    expect(clock(605.4)).toBe('10:05');
    const session = { name: 'x', duration_s: 61, bytes: 2_340_000, complete: true, run: { label: 'Waiter' }, summary: { engaged_s: '59.2', latency_p50_ms: '9.6', spilled: 'no' } };
    expect(figures(session)).toBe('1:01 · Waiter · engaged 0:59 · latency 10 ms · 2.3 MB');
    expect(figures({ ...session, complete: false, run: {}, summary: {} })).toBe('1:01 · 2.3 MB · not closed');
  });
});
