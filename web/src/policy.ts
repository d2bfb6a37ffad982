import type { StateMessage } from './protocol';

/** Who leads while a policy is connected, for people. */
export function policyText(policy: string, turn: boolean, leader: StateMessage['leader']): string {
  if (!turn) return `Policy ‘${policy}’ is connected.`;
  if (leader === 'policy') return `Policy ‘${policy}’ leads. Take hold to take over.`;
  return leader === 'person' ? `You lead. Let go, and policy ‘${policy}’ goes on.` : `Policy ‘${policy}’ has its turn; nobody leads now.`;
}
