import type { Motion } from '../replay/player';

/** Curves by axis, in the base frame of the arm: m and degrees; null where an angle jumps. */
export type ByAxis = Readonly<Record<'x' | 'y' | 'z' | 'roll' | 'pitch' | 'yaw', Values>>;
export type Values = (number | null)[];
export type Times = number[];

/** Curves of one tool. */
export type ToolCurve = keyof ByAxis | 'lateral' | 'vertical' | 'position_error' | 'orientation_error';
/** Curves of all plans of one profile, over their times. */
export type PlanCurve = ToolCurve | 'solve_time' | 'iterations' | 'distance';

/** Results of one profile. */
export interface Result extends Readonly<Record<PlanCurve, Values>> {
  name: string;
  label: string;
  /** By the name in a profile's file; an entry without a name is a remark. */
  weights: readonly { name: string; text: string }[];
  led_s: number;
  /** SI units, us; null: not known. */
  metrics: Readonly<Record<'spills' | 'spilled_share' | 'spills_per_minute' | 'lateral_mean' | 'lateral_max' | 'position_mean' | 'position_rms' | 'solve_mean', number | null>>;
  t: Times;
  /** Behind the first tool, of which are the other members. */
  other_tools?: readonly ({ name: string } & Pick<Result, 'metrics'> & Readonly<Record<ToolCurve, Values>>)[];
  /** mm */
  distance_between_arms?: Values;
  objects: readonly string[];
  object_distances: readonly Values[];
  /** s, of steps that failed. */
  failures: Times;
  terms: readonly string[];
  term_names: readonly string[];
  shares: readonly (readonly number[])[];
  tail: { ms: Times; percent: Values };
  joints: readonly string[];
  joint_names: readonly string[];
  speeds: { t: Times; percent: readonly Values[] };
}

/** A row of the comparison; `best`: index of the best profile, -1: none. */
export interface FigureRow { group: string; label: string; unit: string; meaning: string; best: number; texts: readonly string[] }

/** Of a live session; times in s from its start, except those of `motion`, where the start is `zero_s`. */
export interface Session {
  zero_s: number;
  begin: number;
  end: number;
  led_s: number;
  has_glass: boolean;
  knows_liquid: boolean;
  latency: { t: Times; p50: Values; p99: Values };
  /** As printed by `steadyhand describe`; empty: not recorded. */
  robot: string;
  motion: Motion | null;
}

/** The data that the program writes into the report's page (src/steadyhand/report/figures/page_data.cpp). */
export interface Report {
  recording: string;
  title: string;
  recorded: string;
  command: string;
  rate_hz: number;
  scales: string;
  /** Names of the robot's tools, if it has several. */
  tools?: readonly string[];
  steps_per_point: number;
  commands_per_point: number;
  figures: readonly FigureRow[];
  targets: readonly ({ label: string; t: Times } & ByAxis)[];
  profiles: readonly Result[];
  session?: Session;
}
