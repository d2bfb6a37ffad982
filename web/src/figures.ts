/**
 * How each quantity is written, wherever it stands: in the status, the tables, a replay, the list, the headset, the report.
 */
type Known = number | null | undefined;

const digits = (value: Known, count: number): string => (value === null || value === undefined || !Number.isFinite(value) ? '–' : value.toFixed(count));

/** Of either sign; what rounds to 0 has none. */
export const wholeText = (value: number): string => String(Math.round(value) + 0);
/** m/s^2, sideways acceleration of the liquid, also as a mean or a peak. */
export const sloshText = (value: Known): string => digits(value, 2);
/** mm, from target to glass, at a time. */
export const offText = (value: Known): string => digits(value, 0);
/** mm, the same as a mean. */
export const meanOffText = (value: Known): string => digits(value, 1);
/** ms, from the hand to the command. */
export const latencyText = (value: Known): string => digits(value, 1);
/** ms, of a plan. */
export const planningText = (value: Known): string => digits(value, 2);
/** s, as a number in a narrow column of seconds: tenths below ten. */
export const secondsText = (value: Known): string => digits(value, (value ?? 0) < 9.95 ? 1 : 0);
/** Of the hand's motion: three figures, as the report has them. */
export const scaleText = (value: number): string => String(Number(value.toPrecision(3)));
/** %, of a share: "3.6", "100", "less than 0.1". */
export function percentText(share: number): string {
  const text = digits(100 * share, 1);
  return text === '100.0' ? '100' : text === '0.0' && share > 0 ? 'less than 0.1' : text;
}
/** So many times, and how often that is in a minute of these seconds. */
export function rateText(count: number, seconds: number): string {
  return seconds > 0 ? `${count} ×, ${digits((60 * count) / seconds, 1)} a minute` : `${count} ×`;
}

/** Seconds with tenths, and from a minute on as a clock. */
export function spanText(seconds: number): string {
  return seconds < 59.95 ? `${digits(seconds, 1)} s` : clock(Math.round(seconds));
}

/** m:ss */
export function clock(seconds: number): string {
  const whole = Math.floor(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}`;
}

/** Ends of a part's name that say what kind of thing a program takes it for. */
const KIND = /_(joint|link|body|bottom|top)$/;
/** What is counted on an arm: the number is a part's name. */
const COUNTED = /(^|_)(wrist|joint|axis|finger|left|right)$/;

/** A body or a joint as people call it: "forearm" of forearm_5, "wrist 3" of wrist_3_joint and of wrist_3_0. */
export function partText(name: string): string {
  let part = name.replace(KIND, '');
  const rest = part.replace(/_\d+$/, '');
  if (rest !== '' && !COUNTED.test(rest)) part = rest;
  return part.replace(KIND, '').replaceAll('_', ' ');
}
