/** The messages of docs/reference/protocol.md: SI units, radians; poses in robot axes (z up). This file is made of the
 * descriptions in src/steadyhand/operator/protocol/page_messages.hpp by tests/operator/protocol/protocol_files_test.cpp. */
import type { Cell, Robot, StudyContent, StudyReply, Measure, Quat, Vec3 } from './descriptions';

export * from './descriptions';

export const PROTOCOL_VERSION = 3;

/** first message. Another version is answered with error `version` and closed */
export interface HelloMessage { type: 'hello'; version: number; /** from an earlier `paired` */ token?: string; }

/** answered with `paired` or error `code` */
export interface PairMessage { type: 'pair'; code: string; }

/** takes control. Refused with `unpaired` or `taken` */
export interface TakeMessage { type: 'take'; }

/** releases control; also withdraws an `ask` */
export interface ReleaseMessage { type: 'release'; }

/** asks the client that has control for it; if `take` would succeed, does the same. Refused with `unpaired` or `taken` (another client asks already, or this one was refused just now) */
export interface AskMessage { type: 'ask'; }

/** the holder's answer to `ask`: true gives control, false keeps it; then the asking client gets `taken` */
export interface AnswerMessage { type: 'answer'; grant: boolean; }

/** the hand in the operator's frame */
export interface SampleMessage {
  type: 'sample';
  /** grows with each */ sequence: number;
  /** the client's clock when the hand was there, s */ t_s: number;
  /** m */ p: Vec3;
  q: Quat;
  /** the operator holds the arm engaged */ clutch: boolean;
  /** the device knows the pose */ tracked: boolean;
  /** WebXR's `emulatedPosition` */ emulated: boolean;
  /** time by which the pose was predicted, s */ lead_s?: number;
  /** 0 open to 1 closed; absent: as it is */ gripper?: number;
  /** which of the robot's tools this hand moves; absent: 0 */ tool?: number;
}

/** Where an object stands and how large it is. */
export type PlacedShape = {
  /** in the base's frame, m */ p: Vec3;
  q: Quat;
  /** absent: 0.01, m */ margin?: number;
  /** absent: 0, m/s */ velocity?: Vec3;
} & (
  | { shape: 'sphere'; radius: number }
  | { shape: 'capsule' | 'cylinder'; radius: number; length: number }
  | { shape: 'box'; size: Vec3; rounding?: number }
  | { shape: 'half_space' }
);

export type EpisodeKind = 'begin' | 'keep' | 'discard' | 'mark';

/** what the operator asks for */
export type RequestMessage = { type: 'request'; } & (
  | { kind: 'stop' | 'reset' | 'refill' }
  | { kind: 'profile' | 'playback' | 'detach' | 'delete'; text: string }
  | { kind: 'weight'; text: string; value: number }
  | { kind: 'scale' | 'yaw' | 'tilt' | 'fill' | 'rate' | 'latency' | 'policy' | 'record'; value: number }
  | { kind: 'object'; text: string; object: PlacedShape | null }
  | { kind: 'attach'; text: string; tool?: number }
  | { kind: 'episode'; text: EpisodeKind; success?: boolean; task?: string; notes?: string }
  | { kind: 'set_up'; value?: number }
  | { kind: 'label' | 'rename'; text: string; to: string }
);

/** content that every page shows, `null` when the study is over: from one program at a time, of the same user on the same machine; and from the server at each change and to clients that connect later */
export interface StudyMessage { type: 'study'; content: StudyContent | null; }

/** a paired client's answer, `{key, value}`, to the program that runs the study */
export interface ReplyMessage { type: 'reply'; content: StudyReply; }

/** from one paired client at a time, which then sends where each tool is to be ([policies.md](../how-to/policies.md)). It may move the arm once the client that has control requests it */
export interface PolicyMessage { type: 'policy'; name: string; /** between targets, s */ period_s: number; }

/** from the policy: where a tool is to be, in the base, when its next target is due. Dropped if the state is more than 0.5 s old */
export interface TargetMessage {
  type: 'target';
  /** `now_s` of the state that it was made of, s */ of_s: number;
  /** null: it has no numbers, m */ p: Vec3 | null;
  /** null, too, then */ q: Quat | null;
  /** 0 open to 1 closed; absent: as it is */ gripper?: number;
  /** which of the robot's tools; absent: 0 */ tool?: number;
}

/** from a paired client: the pictures of these come from now on, and of no others; `[]`: none. A name that is none of `welcome.cameras` is refused with `unknown`, and nothing changes */
export interface WatchMessage { type: 'watch'; /** names */ cameras: string[]; }

/** answered with `pong` */
export interface PingMessage {
  type: 'ping';
  /** the client's clock, now, s */ t_s: number;
  /** `now_s` of the newest `pong` or `state`, s */ echo_s?: number;
  /** since that came, s */ held_s?: number;
}

export type ClientMessage = HelloMessage | PairMessage | TakeMessage | ReleaseMessage | AskMessage | AnswerMessage | SampleMessage | RequestMessage | StudyMessage | ReplyMessage | PolicyMessage | TargetMessage | WatchMessage | PingMessage;

export interface WeightRange { min: number; max: number; /** by factors, and 0 at the lower end */ logarithmic: boolean; }

/** An objective that the arm's motion is weighed by. */
export interface Term {
  name: string;
  /** for people */ label: string;
  /** a weight's unit */ unit: string;
  /** number of its weights */ count: number;
  /** weights to choose among */ range: WeightRange;
  /** whether its weight is for the operator to choose */ offered: boolean;
}

export interface Profile {
  index: number;
  name: string;
  /** for people */ label: string;
  /** the largest weight of each of `welcome.terms` */ weights: number[];
}

/** A camera of the session. */
export interface CameraFacts {
  name: string;
  /** pixels */ width: number;
  /** pixels */ height: number;
  /** pictures a second, Hz */ rate_hz: number;
}

/** The glass and its liquid. */
export interface GlassSize {
  /** inside, m */ radius: number;
  /** inside, m */ height: number;
  /** level of liquid, m */ fill: number;
}

/** The task in a simulated scene. */
export interface TaskFacts {
  name: string;
  /** for people */ instruction: string;
  /** s */ time_limit: number;
  /** in words */ conditions: string[];
  /** what it looks at */ things: string[];
}

/** the answer to `hello` */
export interface WelcomeMessage {
  type: 'welcome';
  /** the protocol's */ version: number;
  /** your number */ client: number;
  /** its version */ program: string;
  /** objectives whose weights can be asked for */ terms: Term[];
  profiles: Profile[];
  /** built-in hands that may play */ recordings: string[];
  /** in the order in which pictures count them */ cameras: CameraFacts[];
  glass: GlassSize;
  /** null: there is none */ task: TaskFacts | null;
  /** the obstacles around the arm */ cell: Cell | null;
  /** as `steadyhand describe` prints it */ robot: Robot | null;
}

export type SessionState = 'idle' | 'ready' | 'engaged' | 'holding' | 'stopping' | 'fault';

export type ReasonCode = 'starting' | 'arm_stopped' | 'failed' | 'ready' | 'stop_asked' | 'stalled' | 'off_path' | 'reset' | 'silent' | 'released' | 'profile_waits' | 'gripped' | 'hand_lost' | 'no_pose' | 'hand_back' | 'planner_late' | 'other_lost' | 'other_silent';

export type Leader = 'person' | 'recording' | 'policy';

export type ConstraintKind = 'none' | 'position' | 'velocity' | 'acceleration' | 'self_collision' | 'reach' | 'obstacle';

/** A limit that holds the arm back. */
export interface ActiveConstraint {
  /** which limit */ kind: ConstraintKind;
  /** joint, or (first) body; -1: none */ first: number;
  /** second body of the pair, or object; -1: none */ second: number;
}

/** Position, m, and orientation as a unit quaternion x, y, z, w. */
export interface Pose { /** position, m */ p: Vec3; /** orientation x, y, z, w */ q: Quat; }

export interface Liquid {
  /** angles of the surface's normal about x and y, rad */ tilt: [Measure, Measure];
  /** from the surface's highest point to the rim, m */ freeboard: Measure;
  /** stays true until the arm is engaged again, is reset, or the glass is refilled */ spilled: boolean;
  /** share of the liquid */ spilled_share: number;
  /** since the glass was filled, m */ least_freeboard: Measure;
  /** lateral specific force on it, the largest of the last 20 ms, m/s^2 */ lateral: Measure;
}

/** A tool, and the hand that moves it. */
export interface Tool {
  /** whether it follows its hand */ state: SessionState;
  /** why, for people: its words may change */ reason: string;
  /** the event that caused the state */ reason_code: ReasonCode;
  /** whose hand was on the clutch then */ reason_leader: Leader;
  /** where the controlled frame is, in the base */ pose: Pose;
  /** where the operator wants it; without a grip, where it is */ target: Pose;
  /** it is to follow the target */ engaged: boolean;
  /** whose hand it follows; null: none */ leader: Leader | null;
  /** specific force on the glass, in its frame, m/s^2 */ local_acceleration: [Measure, Measure, Measure];
  /** target to tool; null without a grip, m */ tracking_error: Measure;
  /** measured, 0 open to 1 closed; null: it is none */ gripper: Measure;
  /** where it is commanded to be */ gripper_command: Measure;
  /** positions at the plan's nodes, in the base, m */ path: Vec3[];
  /** where the hand is expected at the nodes of the horizon: x, y, z and standard deviations along and across its way (0: not known); none without a grip, m */ prediction: [number, number, number, number, number][];
  /** in the glass, simulated */ liquid: Liquid;
}

/** Percentiles of the last seconds. */
export interface Timing {
  /** median, us */ p50: Measure;
  /** us */ p99: Measure;
  /** us */ p999: Measure;
  /** us */ max: Measure;
}

/** How the task of a simulated scene goes. */
export interface TaskProgress {
  /** since the first grip after the scene was set up, or since an episode began, s */ time: number;
  /** a bit for each of `welcome.task.conditions` */ held: number;
  /** share of the liquid */ spilled: number;
  /** null: not decided */ success: boolean | null;
  /** x, y, z (m) and quaternion of each of `welcome.task.things`, base frame */ things: [Measure, Measure, Measure, Measure, Measure, Measure, Measure][];
}

/** The one that runs, or ran last. */
export interface Episode {
  running: boolean;
  /** from 1; 0: there was none */ number: number;
  /** time that it has run, s */ time: number;
  /** episodes, recorded */ kept: number;
  /** episodes, recorded */ discarded: number;
  /** episodes that are not recorded to their end */ lost: number;
  /** null: not decided */ success: boolean | null;
}

/** The operator's choices that are in force. */
export interface Controls {
  /** index of `welcome.profiles` */ profile: number;
  /** index of `welcome.recordings`, which moves the arm; -1: none */ playback: number;
  /** name of the one that is connected; empty: none */ policy: string;
  /** it moves the arm whenever no person does */ policy_turn: boolean;
  /** the largest weight of each of `welcome.terms` */ weights: number[];
  /** metres of the tool for each metre of the hand */ scale: number;
  /** turn of the operator's axes about the base's z, rad */ yaw: number;
  /** how far the glass may lean with the hand, rad */ tilt: number;
  /** level of liquid in the glass, m */ fill: number;
  /** plans spill nothing */ no_spill: boolean;
  /** added on purpose between the hand's gate and the planner, s */ latency: number;
}

/** one look at the session, about 60 times a second */
export interface StateMessage {
  type: 'state';
  /** the session's clock, s */ now_s: number;
  /** what the arm may do; engaged: it follows a hand, of which `tools` has each */ state: SessionState;
  /** why, for people: its words may change */ reason: string;
  /** the event that caused the state */ reason_code: ReasonCode;
  /** whose hand was on the clutch then */ reason_leader: Leader;
  /** the limit that holds the arm back */ constraint: ActiveConstraint;
  /** (m) measured, rad */ q: number[];
  /** (m/s) measured, rad/s */ dq: number[];
  /** (m) commanded, rad */ command: number[];
  /** those of `welcome.robot`, in that order */ tools: Tool[];
  /** distance of the nearest pair of bodies, m */ clearance: Measure;
  /** the nearest pair of bodies */ nearest: [number, number];
  /** time of a planning step, us */ solve_us: Timing;
  /** from hand to command, us */ latency_us: Timing;
  /** plans that were followed */ plans: number;
  /** control cycles */ cycles: number;
  /** control cycles that were missed */ missed_deadlines: number;
  /** plans that were late, or failed their check */ rejected_plans: number;
  /** samples of the hand */ samples: number;
  /** planning steps a second, Hz */ planner_rate_hz: number;
  /** it follows what the machine sustains */ planner_rate_automatic: boolean;
  /** the session is being recorded */ recording: boolean;
  /** null: there is none */ task: TaskProgress | null;
  /** the one that runs, or ran last */ episode: Episode;
  /** as they are in force */ controls: Controls;
}

/** it has changed */
export interface CellMessage { type: 'cell'; /** as in `welcome` */ cell: Cell; }

/** at each change, and to clients that connect later */
export interface CamerasMessage {
  type: 'cameras';
  /** for each camera why no more pictures come, `""`: they do */ ended: string[];
}

/** to the program that runs the study */
export interface RepliedMessage { type: 'reply'; /** the client that answers */ client: number; content: StudyReply; }

export interface PairedMessage { type: 'paired'; /** for `hello` after a reconnection */ token: string; }

/** at every change */
export interface LeaseMessage {
  type: 'lease';
  /** a client's number, 0: none */ holder: number;
  yours: boolean;
  /** `take` would give it to you */ takeable: boolean;
  /** the client that asks for it, 0: none */ asker: number;
  /** until `asker` gets it, if nothing moves the arm; null: no client asks, or something moves it now, s */ grant_s: Measure;
}

/** a client asked for a stop; to all clients, ten a second at most */
export interface StoppedMessage { type: 'stopped'; /** the client that asked for it */ client: number; }

/** the answer to `ping` */
export interface PongMessage { type: 'pong'; /** from the ping, s */ t_s: number; /** the session's clock, s */ now_s: number; }

export type Refusal = 'malformed' | 'version' | 'unpaired' | 'code' | 'no_lease' | 'taken' | 'too_many' | 'full' | 'late' | 'unknown';

export interface ErrorMessage { type: 'error'; code: Refusal; /** for people: show it */ message: string; }

export type ServerMessage = WelcomeMessage | StateMessage | CellMessage | CamerasMessage | StudyMessage | RepliedMessage | PairedMessage | LeaseMessage | StoppedMessage | PongMessage | ErrorMessage;

export type RequestKind = RequestMessage['kind'];

const KNOWN: ReadonlySet<string> = new Set(['welcome', 'state', 'cell', 'cameras', 'study', 'reply', 'paired', 'lease', 'stopped', 'pong', 'error']);

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
