import { describe, expect, it } from 'vitest';
import { changesOf, editOf, whyNoName } from '../src/edit_form';

describe('the form of a recording', () => {
  it('says which names a file may have, as the program does', () => {
    for (const name of ['first-spill', '2026-11-26_04-35-36', 'a.b', '-x', '_']) expect(whyNoName(name)).toBe('');
    for (const name of ['', '.hidden', 'First spill / run', 'a/b', 'ä', 'x'.repeat(129)]) expect(whyNoName(name)).toContain('is no name');
  });

  it('asks for what was changed, the name last', () => {
    const edit = editOf('old', 'calm');
    expect(changesOf(edit, 'calm')).toEqual([]);
    Object.assign(edit, { label: ' wild ', to: 'new ' });
    expect(changesOf(edit, 'calm')).toEqual([['label', 'wild'], ['rename', 'new']]);
    expect(changesOf(editOf('old'), '')).toEqual([]);
  });
});
