import { chainOf, type Robot } from '../descriptions';
import type { ActiveConstraint } from '../protocol';

export type Side = 'left' | 'right';

/** m, to the operator's left: where the arm of this tool stands. Where both arms have a common trunk, on that. */
function asideOf(robot: Robot, tool: number, yaw: number): number {
  const others = new Set(robot.tools.flatMap((_, t) => (t === tool ? [] : chainOf(robot, t))));
  const first = robot.joints[chainOf(robot, tool).find((k) => !others.has(k)) ?? -1];
  return first ? Math.cos(yaw) * first.origin[1]![3]! - Math.sin(yaw) * first.origin[0]![3]! : 0;
}

/**
 * Which tool the operator's hand of this side moves. The tools named left and right are those of these hands; others
 * as the operator sees them.
 * @param yaw rad, of the operator's axes about the base's z
 */
export function toolOf(side: Side, robot: Robot | null | undefined, yaw: number, swapped = false): number {
  if (!robot || robot.tools.length < 2) return 0;
  const named = (name: string): number => robot.tools.findIndex((tool) => tool.name.toLowerCase().split(/[^a-z]+/).includes(name));
  const [left, right] = [named('left'), named('right')];
  const isLeft = left >= 0 && right >= 0 && left !== right ? left : asideOf(robot, 1, yaw) > asideOf(robot, 0, yaw) ? 1 : 0;
  return (side === 'left') === swapped ? 1 - isLeft : isLeft;
}

/** Whether a limit is one of this tool's arm; what is not known of one arm is of both. */
export function isLimitOf(tool: number, { kind, first, second }: ActiveConstraint, robot: Robot | null | undefined): boolean {
  if (kind === 'none' || kind === 'reach' || !robot || robot.tools.length < 2) return kind !== 'none';
  const chain = chainOf(robot, tool), of = (body: number): boolean => chain.includes((robot.bodies[body]?.link ?? chain[0]! + 1) - 1);
  if (kind === 'position' || kind === 'velocity' || kind === 'acceleration') return chain.includes(first);
  return of(first) || (kind !== 'obstacle' && of(second));
}
