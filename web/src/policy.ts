import type { Leader } from './protocol';

/** Text: what controls the arm while a policy is connected. */
export function policyText(policy: string, turn: boolean, leader: Leader | null): string {
  if (!turn) return `Policy ‘${policy}’ is connected.`;
  if (leader === 'policy') return `Policy ‘${policy}’ controls the arm. Engage to take over.`;
  return leader === 'person' ? `You control the arm. Release, and policy ‘${policy}’ continues.` : `It is the turn of policy ‘${policy}’; the arm is not engaged now.`;
}
