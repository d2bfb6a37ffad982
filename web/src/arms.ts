import { made, put } from './element';
import { offText } from './figures';
import { TOOL_MARKS } from './scene/tool_colors';
import type { Session } from './session';

interface Chip { button: HTMLButtonElement; state: HTMLElement; off: HTMLElement; bar: HTMLElement; why: HTMLElement }

/** Of a robot with two tools: name, state, tracking error and wave of each. A press makes it the active tool. */
export class Arms {
  #chips: Chip[] = [];

  constructor(private readonly root: HTMLElement, private readonly session: Session, private readonly choose: (tool: number) => void) {}

  offer(names: readonly string[]): void {
    this.root.hidden = names.length < 2;
    this.#chips = this.root.hidden ? [] : names.map((name, i) => {
      const [state, off, bar, why] = [made('b'), made('span'), made('i'), made('small')];
      const button = made('button', { type: 'button', title: 'Mouse and keys move this arm (Tab in the scene: the other)', onclick: () => this.choose(i) },
        made('span', { className: 'name' }, `${TOOL_MARKS[i]} ${name}`), state, off, made('span', { className: 'bar' }, bar), why);
      button.dataset.tool = String(i);
      return { button, state, off, bar, why };
    });
    this.root.replaceChildren(...this.#chips.map(({ button }) => button));
  }

  /** @param present the state is current, and no recording is shown */
  draw(present: boolean): void {
    const { session } = this;
    this.#chips.forEach(({ button, state, off, bar, why }, i) => {
      const tool = present ? session.state?.tools[i] : undefined, wave = present ? session.wave(i) : null;
      if (button.getAttribute('aria-pressed') !== String(i === session.active)) button.setAttribute('aria-pressed', String(i === session.active));
      put(button.dataset, 'state', tool?.state ?? 'idle');
      put(state, 'textContent', !tool ? '–' : tool.state === 'stopping' && session.rests ? 'stopped' : tool.state);
      const error = typeof tool?.tracking_error === 'number' ? `${offText(1000 * tool.tracking_error)} mm off` : '';
      const spilled = tool && session.isGlass(i) && tool.liquid.spilled ? 'spilled' : '';
      put(off, 'textContent', [error, wave ? `wave ${offText(wave.now)} of ${offText(wave.room)} mm` : spilled].filter(Boolean).join(', '));
      put(bar.style, 'width', `${wave ? Math.round((100 * wave.now) / wave.room) : 0}%`);
      put(bar.parentElement!, 'hidden', !wave);
      put(why, 'textContent', tool && tool.reason_code !== 'ready' ? tool.reason : '');
    });
  }
}
