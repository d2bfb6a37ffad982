/** cos and sin of this many equal steps around a circle; the first is repeated at the end. */
export function circle(steps: number): { cos: Float64Array; sin: Float64Array } {
  const angle = (_: unknown, i: number): number => (2 * Math.PI * i) / steps;
  const angles = Float64Array.from({ length: steps + 1 }, angle);
  return { cos: angles.map(Math.cos), sin: angles.map(Math.sin) };
}
