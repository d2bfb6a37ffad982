/** The words of docs/reference/protocol.md. Units: SI, radians; quaternions x, y, z, w; poses in robot axes (z up). */

export const PROTOCOL_VERSION = 2;

export type Vec3 = readonly [number, number, number];
export type Quat = readonly [number, number, number, number];

export interface Pose { p: Vec3; q: Quat }

export type RequestKind = 'stop' | 'reset' | 'profile' | 'weight' | 'scale' | 'yaw' | 'tilt' | 'fill' | 'refill' | 'rate' | 'playback' | 'record' | 'latency' | 'attach' | 'detach' | 'label' | 'rename' | 'delete' | 'episode' | 'set_up' | 'policy';

export type ClientMessage =
  | { type: 'hello'; version: number; token?: string }
  | { type: 'pair'; code: string }
  | { type: 'take' }
  | { type: 'release' }
  | { type: 'ask' }
  | { type: 'answer'; grant: boolean }
  | { type: 'sample'; sequence: number; t_s: number; p: Vec3; q: Quat; clutch: boolean; tracked: boolean; emulated: boolean; lead_s?: number; gripper?: number }
  | { type: 'request'; kind: RequestKind; text?: string; value?: number; to?: string; success?: boolean; notes?: string }
  | { type: 'request'; kind: 'object'; text: string; object: PlacedShape | null }
  | { type: 'reply'; content: { key: string; value: number } }
  | { type: 'policy'; name: string; period_s: number }
  | { type: 'target'; of_s: number; p: Vec3 | null; q: Quat | null; gripper?: number }
  | { type: 'watch'; cameras: readonly string[] }
  | { type: 'ping'; t_s: number; echo_s?: number; held_s?: number };

export type SessionState = 'idle' | 'ready' | 'engaged' | 'holding' | 'stopping' | 'fault';
export type ConstraintKind = 'none' | 'position' | 'velocity' | 'acceleration' | 'self_collision' | 'reach' | 'obstacle';

/** A number that the server may not know. */
export type Measure = number | null;

export interface Timing { p50: Measure; p99: Measure; p999: Measure; max: Measure }

export interface Controls {
  profile: number;
  playback: number;
  /** Name of the policy that is connected; empty: none. */
  policy: string;
  /** It leads wherever no person does. */
  policy_turn: boolean;
  /** Of each of `welcome.terms`; where a term has several, the first. */
  weights: number[];
  scale: number;
  yaw: number;
  /** rad, how far the glass may lean with the hand. */
  tilt: number;
  /** m of liquid in the glass. */
  fill: number;
  no_spill: boolean;
  /** s, added on purpose between the hand's gate and the planner. */
  latency: number;
}

/** The event that caused the state. */
export type ReasonCode = 'starting' | 'arm_stopped' | 'failed' | 'ready' | 'stop_asked' | 'stalled' | 'off_path' | 'reset' | 'silent' | 'released' | 'profile_waits' | 'gripped' | 'hand_lost' | 'no_pose' | 'hand_back' | 'planner_late';

export interface StateMessage {
  type: 'state';
  now_s: number;
  state: SessionState;
  /** For people: its words may change. */
  reason: string;
  reason_code: ReasonCode;
  /** Whose hand was on the clutch then. */
  reason_leader: 'person' | 'recording' | 'policy';
  constraint: { kind: ConstraintKind; first: number; second: number };
  q: number[];
  dq: number[];
  command: number[];
  /** Measured, 0 open to 1 closed; null: the arm has none. */
  gripper: Measure;
  /** What it is told. */
  gripper_command: Measure;
  tool: Pose;
  target: Pose;
  engaged: boolean;
  /** Whose hand the arm follows; null: nobody's. */
  leader: 'person' | 'recording' | 'policy' | null;
  local_acceleration: [Measure, Measure, Measure];
  tracking_error: Measure;
  clearance: Measure;
  nearest: [number, number];
  path: Vec3[];
  /** Where the hand is expected, x, y and z, and standard deviations along and across its way, m; 0: not known. */
  prediction: [number, number, number, number, number][];
  /** `least_freeboard`: since the glass was filled. `lateral`: m/s^2, sideways force, the largest of the last 20 ms. */
  liquid: { tilt: [Measure, Measure]; freeboard: Measure; spilled: boolean; spilled_share: number; least_freeboard: Measure; lateral: Measure };
  solve_us: Timing;
  latency_us: Timing;
  plans: number;
  cycles: number;
  missed_deadlines: number;
  rejected_plans: number;
  samples: number;
  planner_rate_hz: number;
  /** It follows what the machine sustains. */
  planner_rate_automatic: boolean;
  recording: boolean;
  /** How the task of a simulated scene goes; null: there is none. `held`: a bit for each of `welcome.task.conditions`. `time`: s; `things`: poses of those of `welcome.task`, in the base: x, y, z and quaternion. */
  task: { time: number; held: number; spilled: number; success: boolean | null; things: number[][] } | null;
  /** The one that runs, or ran last; number 0: there was none. `lost`: how many are not recorded to their end. */
  episode: { running: boolean; number: number; time: number; kept: number; discarded: number; lost: number; success: boolean | null };
  controls: Controls;
}

/** An objective that the arm's motion is weighed by. */
export interface Term {
  name: string;
  label: string;
  /** Of a weight. */
  unit: string;
  /** How many weights it has. */
  count: number;
  /** Weights to choose among: evenly, or by factors and 0 at the lower end. */
  range: { min: number; max: number; logarithmic: boolean };
  /** Whether its weight is for the operator to choose. */
  offered: boolean;
}

/** `weights`: as in Controls. */
export interface Profile { index: number; name: string; label: string; weights: number[] }

/** A solid that covers part of a link: m, `origin` (4 x 4) of its frame in the link's. A capsule's length is that between its ends' centres. */
export type Body = { name: string; link: number; origin: number[][] } & (
  { shape: 'sphere'; radius: number } | { shape: 'capsule' | 'cylinder'; length: number; radius: number } |
  { shape: 'box'; size: Vec3; rounding: number });

/** What `steadyhand describe` prints. */
/** @property meshes whose are drawn, if not its own @property mount of the URDF's root in the base, if it is not there */
export interface Robot {
  name: string;
  meshes?: string;
  mount?: number[][];
  joints: { name: string; type?: 'revolute' | 'prismatic'; origin: number[][]; axis: Vec3 }[];
  tool: { name: string; origin: number[][] };
  /** The tool is one, and holds no glass. */
  gripper?: { closes_in: number };
  home: number[];
  /** rad (m), rad/s (m/s) */
  position_min?: number[];
  position_max?: number[];
  velocity_max?: number[];
  bodies: Body[];
  pairs: [number, number][];
}

/** As of Body; a half-space is all with z <= 0. */
type Shape = { shape: 'sphere'; radius: number } | { shape: 'capsule' | 'cylinder'; length: number; radius: number } |
  { shape: 'box'; size: Vec3; rounding: number } | { shape: 'half_space' };
/** Something solid around the arm; `origin` is in the base's frame, or in the tool's if `attached`, `velocity` m/s. `color`: "#rrggbb", "" or "none". */
export type CellObject = { name: string; origin: number[][]; velocity: Vec3; margin: number; color: string; holds_only_tool: boolean; attached: boolean } & Shape;
/** How a client says where one stands. */
export type PlacedShape = { p: Vec3; q: Quat; margin?: number; velocity?: Vec3 } & Shape;
/** @property at_s when, on the session's clock, what moves is where it says; nothing moves in a cell without it. */
export interface Cell { name: string; at_s?: number; objects: CellObject[] }

/** The glass and its liquid, m; radius and height are inside. */
export interface GlassSize { radius: number; height: number; fill: number }

/** A camera of the session; pixels, pictures a second. */
export interface CameraFacts { name: string; width: number; height: number; rate_hz: number }

export interface WelcomeMessage {
  type: 'welcome';
  version: number;
  client: number;
  program: string;
  terms: Term[];
  profiles: Profile[];
  recordings: string[];
  /** In the order in which pictures count them. */
  cameras: CameraFacts[];
  /** What is to be done in a simulated scene. */
  task: { name: string; instruction: string; time_limit: number; conditions: string[]; things: string[] } | null;
  glass: GlassSize;
  cell: Cell | null;
  robot: Robot | null;
}

/** Where the glass is to go, m, in the base; a gate is passed, elsewhere the glass stays. */
export interface StudyGoal { p: Vec3; radius: number; gate: boolean }

/** What the program that leads a study has the pages show. `display_latency`: s, by which states are drawn late on purpose. */
export type StudyContent = { title: string; participant: string; text: string } & (
  | { kind: 'text' }
  | { kind: 'question'; key: string; low: number; high: number; low_text: string; high_text: string; place: string }
  | { kind: 'task'; goal: StudyGoal | null; following: StudyGoal | null; done: number; of: number; display_latency: number });

export type Refusal = 'malformed' | 'version' | 'unpaired' | 'code' | 'no_lease' | 'taken' | 'too_many' | 'full' | 'late' | 'unknown';

export type ServerMessage =
  | WelcomeMessage
  | StateMessage
  | { type: 'cell'; cell: Cell }
  | { type: 'cameras'; ended: string[] }
  | { type: 'study'; content: StudyContent | null }
  | { type: 'reply'; client: number; content: object }
  | { type: 'paired'; token: string }
  | { type: 'lease'; holder: number; yours: boolean; takeable: boolean; asker: number; grant_s: Measure }
  | { type: 'stopped'; client: number }
  | { type: 'pong'; t_s: number; now_s: number }
  | { type: 'error'; code: Refusal; message: string };

const KNOWN: ReadonlySet<string> = new Set(['welcome', 'state', 'cell', 'paired', 'lease', 'pong', 'error', 'study', 'reply', 'cameras', 'stopped']);

/** Bytes before a picture's H.264. */
export const PICTURE_HEAD = 16;
/** `exposed`: s, of the session's clock. */
export interface PictureHead { camera: number; isKey: boolean; exposed: number }

/** null: nothing that a server of this version says. */
export function pictureHead(message: ArrayBuffer): PictureHead | null {
  if (message.byteLength <= PICTURE_HEAD) return null;
  const head = new DataView(message, 0, PICTURE_HEAD);
  return head.getUint8(0) === 1 ? { camera: head.getUint16(2, true), isKey: (head.getUint8(1) & 1) !== 0, exposed: head.getFloat64(8, true) } : null;
}

/** null: nothing that a server of this version says. */
export function decode(text: string): ServerMessage | null {
  let message: unknown;
  try {
    message = JSON.parse(text);
  } catch {
    return null;
  }
  if (typeof message !== 'object' || message === null || !('type' in message)) return null;
  return typeof message.type === 'string' && KNOWN.has(message.type) ? (message as ServerMessage) : null;
}

export const encode = (message: ClientMessage): string => JSON.stringify(message);
