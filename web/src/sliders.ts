import type { Choices } from './choices';
import { element, made, put } from './element';
import { scaleText } from './figures';
import type { RequestKind, Term, WelcomeMessage } from './protocol';
import type { Session } from './session';
import { STEPS, plain, positionOf, spokenWeight, unitText, weightAt, weightText } from './weights';

interface Slider {
  node: HTMLInputElement;
  output: HTMLElement;
  read(): number | undefined;
  label(value: number): string;
  /** The label for a screen reader, if it differs. */
  spoken?(value: number): string;
  /** The slider's own value for this one. */
  place(value: number): number;
  shown: number;
}

/** deg */
function tiltText(tilt: number): string {
  return tilt < 0.5 ? 'none: upright' : tilt > 179.5 ? 'all: it may pour' : `up to ${tilt.toFixed(0)}°`;
}

/** @param heading deg, positive to the arm's left */
function headingText(heading: number): string {
  const turned = Math.round(Math.abs(heading)), angle = `${heading.toFixed(0)}°`;
  if (turned === 0) return `${angle}, as the arm`;
  if (turned === 180) return `${angle}, to the arm`;
  return `${angle}, to the ${heading > 0 ? 'left' : 'right'}`;
}

/** Texts of a slider's two ends. */
const ends = (low: string, high: string): HTMLElement => made('span', { className: 'ends' }, made('span', {}, low), made('span', {}, high));

/** The sliders of the page: those of index.html, and one for each weight that the server offers. */
export class Sliders {
  readonly #always: Slider[] = [];
  #weights: Slider[] = [];
  /** mm, height of the glass inside. */
  rim = 0;

  constructor(private readonly session: Session, private readonly choices: Choices, private readonly acts: { command(kind: RequestKind, more: { text?: string; value: number }): void; grip(closed: number): void }) {
    const controls = () => this.session.state?.controls;
    this.#add('scale', () => controls()?.scale, (v) => (Math.abs(v - 1) < 0.005 ? '1:1' : `${scaleText(v)} ×`), (value) => this.acts.command('scale', { value }));
    this.#add('yaw', () => { const c = controls(); return c && (c.yaw * 180) / Math.PI; }, (v) => headingText(v),
      (value) => this.acts.command('yaw', { value: (value * Math.PI) / 180 }));
    this.#add('fill', () => { const c = controls(); return c && c.fill * 1000; }, (v) => `${(this.rim - v).toFixed(0)} mm below the rim`,
      (value) => this.acts.command('fill', { value: value / 1000 }));
    this.#add('tilt', () => { const c = controls(); return c && (c.tilt * 180) / Math.PI; }, tiltText,
      (value) => this.acts.command('tilt', { value: (value * Math.PI) / 180 }));
    this.#add('gripper', () => { const g = this.session.tool?.gripper ?? this.session.tool?.gripper_command; return typeof g === 'number' ? g * 100 : undefined; },
      (v) => (v < 2 ? 'open' : v > 98 ? 'closed' : `${v.toFixed(0)} % closed`), (value) => this.acts.grip(value / 100));
  }

  offer({ terms, glass }: WelcomeMessage): void {
    this.rim = glass.height * 1000;
    element('fill', HTMLInputElement).max = String(Math.ceil(this.rim) - 1);
    element('weights', HTMLDivElement).replaceChildren();
    this.#weights = terms.flatMap((term, index) => (term.offered ? [this.#weight(term, index)] : []));
  }

  draw(mayChoose: boolean, now: number): void {
    for (const slider of [...this.#weights, ...this.#always]) {
      const { node } = slider, value = slider.read();
      put(node, 'disabled', !mayChoose);
      if (value === undefined) continue;
      if (value !== slider.shown) {
        slider.output.textContent = slider.label(value);
        node.setAttribute('aria-valuetext', (slider.spoken ?? slider.label)(value));
      }
      slider.shown = value;
      if (this.choices.isAnswered(node, now)) put(node, 'value', String(slider.place(value)));
    }
  }

  #add(id: string, read: () => number | undefined, label: (value: number) => string, send: (value: number) => void): void {
    const node = element(id, HTMLInputElement);
    node.oninput = () => send(Number(node.value));
    this.#always.push({ node, output: element(`${id}-value`, HTMLOutputElement), read, label, place: (value) => value, shown: NaN });
  }

  /** A slider for the weight of the term of this index. */
  #weight(term: Term, index: number): Slider {
    const { range, name } = term, id = `weight-${name}`, words = plain(term);
    const output = made('output', { id: `${id}-value` }, '–');
    const node = made('input', { id, type: 'range', min: '0', max: String(STEPS), step: '1', oninput: () => this.acts.command('weight', { text: name, value: weightAt(range, Number(node.value)) }) });
    output.htmlFor.add(id);
    element('weights', HTMLDivElement).append(made('label', { htmlFor: id, title: `The weight ‘${name}’ of the objective (${term.label}), in ${unitText(term.unit)}` }, `${words.label} `, output, node, ends(words.low, words.high)));
    return { node, output, read: () => this.session.state?.controls.weights[index], label: weightText, spoken: (value) => spokenWeight(range, value, words), place: (value) => positionOf(range, value), shown: NaN };
  }
}
