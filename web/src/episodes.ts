import { element, put } from './element';
import { percentText } from './figures';
import { isTyped } from './input/shortcuts';
import type { Panel } from './panel';
import type { StateMessage, WelcomeMessage } from './protocol';
import type { Session } from './session';

const button = (id: string): HTMLButtonElement => element(id, HTMLButtonElement);

const decided = (success: boolean | null): string => (success === null ? '' : success ? ', a success' : ', a failure');

/** Text of the progress of a simulated task. */
/** @param glass the tool holds one, so that there is something to spill */
export function taskText(task: Omit<NonNullable<WelcomeMessage['task']>, 'things'>, now: Omit<NonNullable<StateMessage['task']>, 'things'>, glass = true): string {
  const holds = task.conditions.filter((_, i) => (now.held >> i) & 1).length;
  const waits = now.success === null && now.time === 0;
  const end = waits ? `${task.time_limit.toFixed(0)} s from Begin or from first engaging` : now.success === null ? `${now.time.toFixed(1)} of ${task.time_limit.toFixed(0)} s` : `${now.success ? 'Done' : 'Time is over'} after ${now.time.toFixed(1)} s`;
  const missing = task.conditions.filter((_, i) => !((now.held >> i) & 1));
  const open = now.success !== null || !missing.length ? '' : `; to do: ${missing.join(', ')}`;
  return `${end}. ${holds} of ${task.conditions.length} hold${open}.${glass ? ` Spilled ${percentText(now.spilled)} %.` : ''}`;
}

/** Text of the number and state of episodes. */
export function episodeText(episode: StateMessage['episode']): string {
  const counts = `${episode.kept} kept, ${episode.discarded} discarded${episode.lost ? `, ${episode.lost} lost: not recorded to the end` : ''}.`;
  if (episode.running) return `Episode ${episode.number} runs: ${episode.time.toFixed(1)} s${decided(episode.success)}. ${counts}`;
  return episode.number ? `Episode ${episode.number} ended after ${episode.time.toFixed(1)} s${decided(episode.success)}. ${counts}` : 'None yet.';
}

/** Starts, keeps and discards episodes, and sets up a simulated scene. */
export class EpisodePanel {
  #session: Session;
  /** It unfolds by itself where there is a task, once. */
  #unfolded = false;

  constructor(session: Session, panel: Panel) {
    this.#session = session;
    const says = (text: 'begin' | 'keep' | 'discard') => () => {
      const success = element('episode-success', HTMLSelectElement), notes = element('episode-notes', HTMLInputElement);
      const words = notes.value.trim();
      panel.command('episode', { text, ...(text === 'keep' && success.value ? { success: success.value === 'yes' } : {}), ...(text !== 'begin' && words ? { notes: words } : {}) });
      if (text !== 'begin') success.value = notes.value = '';
    };
    const actions: [string, string, () => void][] = [
      ['KeyB', 'episode-begin', says('begin')], ['KeyN', 'episode-keep', says('keep')], ['KeyX', 'episode-discard', says('discard')],
      ['KeyR', 'set-up', () => panel.command('set_up', {})],
    ];
    for (const [, id, act] of actions) button(id).onclick = act;
    addEventListener('keydown', (event) => {
      if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || isTyped(event.target)) return;
      const found = actions.find(([code]) => code === event.code);
      if (found && !button(found[1]).disabled) found[2]();
    });
  }

  draw(): void {
    const { welcome, state, past, mayTake, status } = this.#session;
    const task = welcome?.task ?? null, may = status === 'open' && mayTake && !past && state !== null;
    put(element('task', HTMLElement), 'hidden', !task);
    put(button('set-up'), 'hidden', !task);
    put(element('episode-success', HTMLSelectElement).options[0]!, 'textContent', task ? 'as the task says' : 'not judged');
    if (task) {
      if (!this.#unfolded) element('episodes', HTMLDetailsElement).open = this.#unfolded = true;
      put(element('task-words', HTMLElement), 'textContent', task.instruction);
      if (state?.task) {
        const progress = element('task-progress', HTMLElement);
        put(progress, 'textContent', taskText(task, state.task, this.#session.hasGlass));
        put(progress.dataset, 'success', String(state.task.success));
      }
    }
    const running = state?.episode.running ?? false, ended = (state?.episode.number ?? 0) > 0;
    put(button('episode-begin'), 'disabled', !may || running || !state.recording);
    for (const id of ['episode-keep', 'episode-discard']) put(button(id), 'disabled', !may || !(running || ended));
    put(button('set-up'), 'disabled', !may || running);
    if (state) put(element('episodes-now', HTMLOutputElement), 'textContent', running ? `number ${state.episode.number} runs` : ended ? `${state.episode.kept} kept` : '');
    if (state) put(element('episode-state', HTMLElement), 'textContent', state.recording ? episodeText(state.episode) : `Record this session to keep episodes.${ended ? ` ${episodeText(state.episode)}` : ''}`);
  }
}
