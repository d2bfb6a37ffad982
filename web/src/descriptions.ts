/** Parts of the messages of docs/reference/protocol.md. Units: SI, radians; quaternions x, y, z, w. */

export type Vec3 = readonly [number, number, number];
export type Quat = readonly [number, number, number, number];
/** A number that the server may not know. */
export type Measure = number | null;

/** A solid that covers part of a link: m, `origin` (4 x 4) of its frame in the link's. A capsule's length is that between its ends' centres. */
export type Body = { name: string; link: number; origin: number[][] } & (
  { shape: 'sphere'; radius: number } | { shape: 'capsule' | 'cylinder'; length: number; radius: number } |
  { shape: 'box'; size: Vec3; rounding: number });

/** The output of `steadyhand describe`. */
/** @property meshes whose are drawn, if not its own @property mount of the URDF's root in the base, if it is not there */
export interface Robot {
  name: string;
  meshes?: string;
  mount?: number[][];
  /** @property parent link from which it moves its own; absent: that of the joint before */
  joints: { name: string; type?: 'revolute' | 'prismatic'; origin: number[][]; axis: Vec3; parent?: number }[];
  /** One for each arm. @property gripper the tool is one, and holds no glass */
  tools: { name: string; link: number; origin: number[][]; gripper?: { closes_in: number } }[];
  home: number[];
  /** rad (m), rad/s (m/s) */
  position_min?: number[];
  position_max?: number[];
  velocity_max?: number[];
  bodies: Body[];
  pairs: [number, number][];
}

/** Of a tool, if it is a gripper. */
export const gripperOf = (robot: Robot | null | undefined, tool = 0): { closes_in: number } | undefined => robot?.tools?.[tool]?.gripper;

/** Joints on the way from the base to a tool, by index. */
export function chainOf(robot: Pick<Robot, 'joints' | 'tools'>, tool: number): number[] {
  const chain: number[] = [];
  for (let link = robot.tools[tool]!.link; link > 0; link = robot.joints[link - 1]!.parent ?? link - 1) chain.unshift(link - 1);
  return chain;
}

/** As in Body; a half-space is all with z <= 0. */
type Shape = { shape: 'sphere'; radius: number } | { shape: 'capsule' | 'cylinder'; length: number; radius: number } |
  { shape: 'box'; size: Vec3; rounding: number } | { shape: 'half_space' };
/** Something solid around the arm; `origin` is in the base's frame, or if `attached` in that of `tool` (absent: 0); `velocity` m/s. `color`: "#rrggbb", "" or "none". */
export type CellObject = { name: string; origin: number[][]; velocity: Vec3; margin: number; color: string; holds_only_tool: boolean; attached: boolean; tool?: number } & Shape;
/** @property at_s time on the session's clock of the poses of moving parts; nothing moves in a cell without it. */
export interface Cell { name: string; at_s?: number; objects: CellObject[] }

/** Where a glass is to go, m, in the base; a gate is passed, elsewhere the glass stays. */
export interface StudyGoal { p: Vec3; radius: number; gate: boolean }

/**
 * Content that the program of a study shows on the pages. `other_goals`: of the other hand, at the same time.
 * `display_latency`: s by which states are drawn late on purpose.
 */
export type StudyContent = { title: string; participant: string; text: string } & (
  | { kind: 'text' }
  | { kind: 'question'; key: string; low: number; high: number; low_text: string; high_text: string; place: string }
  | { kind: 'task'; goal: StudyGoal | null; other_goals?: StudyGoal[]; following: StudyGoal | null; done: number; of: number; display_latency: number });
/** A participant's answer. */
export interface StudyReply { key: string; value: number }

/** Bytes before the H.264 data of a frame. */
export const PICTURE_HEAD = 16;
/** `exposed`: s, of the session's clock. */
export interface PictureHead { camera: number; isKey: boolean; exposed: number }

/** null: not a message of a server of this version. */
export function pictureHead(message: ArrayBuffer): PictureHead | null {
  if (message.byteLength <= PICTURE_HEAD) return null;
  const head = new DataView(message, 0, PICTURE_HEAD);
  return head.getUint8(0) === 1 ? { camera: head.getUint16(2, true), isKey: (head.getUint8(1) & 1) !== 0, exposed: head.getFloat64(8, true) } : null;
}
