import { expect, it } from 'vitest';
import { policyText } from '../src/policy';

it('tells who leads in a policy’s turn', () => {
  expect(policyText('stack', false, 'person')).toBe('Policy ‘stack’ is connected.');
  expect(policyText('stack', true, 'policy')).toBe('Policy ‘stack’ controls the arm. Engage to take over.');
  expect(policyText('stack', true, 'person')).toBe('You control the arm. Release, and policy ‘stack’ continues.');
  expect(policyText('stack', true, null)).toBe('It is the turn of policy ‘stack’; the arm is not engaged now.');
});
