import { describe, expect, it } from 'vitest';
import { tabByKey } from '../src/tabs';

describe('tabs', () => {
  it('are gone through by arrows, round and round, and to their ends', () => {
    expect(['ArrowRight', 'ArrowLeft', 'Home', 'End', 'KeyW'].map((key) => tabByKey('drive', key))).toEqual(['recordings', 'scene', 'drive', 'scene', null]);
    expect(tabByKey('scene', 'ArrowRight')).toBe('drive');
  });
});
