import type { SessionState } from '../protocol';

export const STATE_COLORS: Record<SessionState, number> = {
  idle: 0x8a94a0, ready: 0x2f7fd0, engaged: 0x16a085, holding: 0xe0a100, stopping: 0xd1561c, fault: 0xc62828,
};

/** Of names; blue and brown differ also for people who confuse red and green. */
export const TOOL_COLORS = [0x1f6bb8, 0xa8652f] as const;
/** In front of the names, so that no tool is known by its colour alone. */
export const TOOL_MARKS = ['●', '◆'] as const;

/** The first tool has the colours of its states; the second has its own while it is ready or engaged. */
export function toolColor(index: number, state: SessionState): number {
  return index > 0 && (state === 'ready' || state === 'engaged') ? TOOL_COLORS[1] : STATE_COLORS[state];
}
