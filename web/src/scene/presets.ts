import type { Vec3 } from '../protocol';

/** Camera positions and the points they look at; m, world frame (y up). The first is behind the operator's shoulder. */
export const PRESETS = {
  shoulder: { from: [-1.33, 1.57, -0.37], at: [0.02, 1.09, -0.97] },
  /** Behind two arms, above them. */
  shoulders: { from: [-0.4, 2.35, 0.3], at: [0.0, 1.02, -1.08] },
  front: { from: [0.1, 1.35, -2.9], at: [0.02, 1.0, -0.85] },
  side: { from: [2.0, 1.3, -0.9], at: [0.02, 1.0, -0.9] },
  top: { from: [-0.02, 3.1, -0.75], at: [0.0, 0.9, -0.9] },
} satisfies Record<string, { from: Vec3; at: Vec3 }>;

export type Preset = keyof typeof PRESETS;
