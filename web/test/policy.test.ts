import { expect, it } from 'vitest';
import { policyText } from '../src/policy';

it('tells who leads in a policy’s turn', () => {
  expect(policyText('stack', false, 'person')).toBe('Policy ‘stack’ is connected.');
  expect(policyText('stack', true, 'policy')).toBe('Policy ‘stack’ leads. Take hold to take over.');
  expect(policyText('stack', true, 'person')).toBe('You lead. Let go, and policy ‘stack’ goes on.');
  expect(policyText('stack', true, null)).toBe('Policy ‘stack’ has its turn; nobody leads now.');
});
