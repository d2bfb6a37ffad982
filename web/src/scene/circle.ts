/** cos and sin of so many equal steps around a circle, and of the first once more. */
export function circle(steps: number): { cos: Float64Array; sin: Float64Array } {
  const angle = (_: unknown, i: number): number => (2 * Math.PI * i) / steps;
  const angles = Float64Array.from({ length: steps + 1 }, angle);
  return { cos: angles.map(Math.cos), sin: angles.map(Math.sin) };
}
