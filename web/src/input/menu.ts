import type { RequestKind } from '../protocol';
import { motionTitle } from '../demo_motions';
import { inOrder } from '../profiles';
import type { Session } from '../session';
import { weightText } from '../weights';

/** What can be pressed on the board; the rows are in order from the top. */
export interface Item { row: string; label: string; on: boolean; act: () => void }

export interface Asks {
  command(kind: RequestKind, more: { text?: string; value?: number; success?: boolean }): void;
  reset(): void;
  recentre(): void;
  /** The hands change their arms. */
  swap(): void;
}

/** Levels of slosh protection, in the weight's unit (s^3/m^2): a press selects the next one. */
const LEVELS = [0, 0.3, 1, 3, 10, 20];
/** Demonstrations that fit. */
const SHOWN = 6;

type Add = (row: string, label: string, on: boolean, act: () => void) => void;

/** What the page's episode panel offers, as far as it needs no text. */
function addEpisode({ welcome, state }: Session, add: Add, { command }: Asks): void {
  if (!welcome || !state) return;
  const { running, number, kept, success } = state.episode;
  if (welcome.task && !running) add('Now', 'New scene', false, () => command('set_up', {}));
  const row = running ? `Episode ${number} runs` : number ? `Episodes: ${kept} kept` : 'Episodes';
  if (state.recording && !running) add(row, 'Begin', false, () => command('episode', { text: 'begin' }));
  if (!running && !number) return;
  add(row, 'Keep', false, () => command('episode', { text: 'keep' }));
  for (const [label, succeeded] of [['Success', true], ['Failure', false]] as const) {
    add(row, label, success === succeeded, () => command('episode', { text: 'keep', success: succeeded }));
  }
  add(row, 'Discard', false, () => command('episode', { text: 'discard' }));
}

/** Row by row, without items that are not available now. */
export function itemsOf(session: Session, asks: Asks): Item[] {
  const { welcome, state } = session;
  if (!welcome || !state || session.past || !session.mayTake) return [];
  const items: Item[] = [];
  const add: Add = (row, label, on, act) => { items.push({ row, label, on, act }); };
  if (session.mayReset) add('Now', 'Reset', false, () => asks.reset());
  add('Now', 'Recentre', false, () => asks.recentre());
  if (session.hasTwo) add('Now', 'Swap hands', false, () => asks.swap());
  add('Now', state.recording ? 'Recording' : 'Record', state.recording, () => asks.command('record', { value: state.recording ? 0 : 1 }));
  if (session.spill()) add('Now', 'Fill the glass', false, () => asks.command('refill', {}));
  addEpisode(session, add, asks);
  for (const profile of inOrder(welcome.profiles)) {
    add('Profile', profile.label.replace(/ \(P\d+\)/, ''), state.controls.profile === profile.index, () => asks.command('profile', { text: profile.name }));
  }
  const lateral = welcome.terms.findIndex(({ name, offered }) => name === 'lateral' && offered), weight = state.controls.weights[lateral];
  if (weight !== undefined) {
    const less = LEVELS.filter((level) => level < weight - 1e-9).at(-1), more = LEVELS.find((level) => level > weight + 1e-9);
    if (less !== undefined) add(`Lateral weight ${weightText(weight)}`, 'less', false, () => asks.command('weight', { text: 'lateral', value: less }));
    if (more !== undefined) add(`Lateral weight ${weightText(weight)}`, 'more', false, () => asks.command('weight', { text: 'lateral', value: more }));
  }
  add('Demo motion', 'none', state.controls.playback < 0, () => asks.command('playback', { text: '' }));
  welcome.recordings.slice(0, SHOWN).forEach((text, i) => {
    add('Demo motion', motionTitle(text), state.controls.playback === i, () => asks.command('playback', { text }));
  });
  return items;
}
