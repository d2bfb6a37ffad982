import * as THREE from 'three';
import { made } from './element';
import './study.css';
import type { ServerMessage, StudyContent, StudyGoal } from './protocol';

const GOAL = 0x2f9e6e, FOLLOWING = 0x8a94a0;
/** One answer for each whole number of a scale, from low to high. */
export const answersOf = (content: { low: number; high: number }): number[] =>
  Array.from({ length: content.high - content.low + 1 }, (_, i) => content.low + i);

/** Holds states back by the display latency of a study; 0 hands them on at once. */
export class DisplayDelay {
  seconds = 0;
  readonly #waiting: { due: number; message: ServerMessage }[] = [];

  constructor(private readonly deliver: (message: ServerMessage) => void) {}

  /** Delays only states, and delivers them in their order. @param now s */
  take(message: ServerMessage, now: number): void {
    if (message.type !== 'state' || this.seconds === 0 && this.#waiting.length === 0) return this.deliver(message);
    this.#waiting.push({ due: now + this.seconds, message });
    this.release(now);
  }

  /** Delivers the messages that are due. */
  release(now: number): void {
    while (this.#waiting.length > 0 && (this.seconds === 0 || this.#waiting[0]!.due <= now)) this.deliver(this.#waiting.shift()!.message);
  }
}

/** Shows the participant of a study a text, a question, and the goal of the glass. */
export class StudyPanel {
  readonly #panel = document.createElement('section');
  readonly #goals = new THREE.Group();
  readonly #ball = new THREE.Mesh(new THREE.SphereGeometry(1, 40, 20), new THREE.MeshBasicMaterial({ color: GOAL, transparent: true, opacity: 0.4, depthWrite: false }));
  readonly #other = this.#ball.clone();
  readonly #ring = new THREE.Mesh(new THREE.TorusGeometry(1, 0.07, 12, 64), new THREE.MeshBasicMaterial({ color: GOAL }));
  readonly #next = new THREE.Mesh(new THREE.TorusGeometry(1, 0.05, 12, 64), new THREE.MeshBasicMaterial({ color: FOLLOWING, transparent: true, opacity: 0.5 }));

  /** @param base the group of the arm's base frame; @param reply sends an answer */
  constructor(base: THREE.Group, private readonly delay: DisplayDelay, private readonly reply: (key: string, value: number) => void) {
    this.#panel.id = 'study';
    this.#panel.hidden = true;
    this.#panel.setAttribute('aria-live', 'polite');
    document.body.append(this.#panel);
    this.#goals.add(this.#ball, this.#other, this.#ring, this.#next);
    this.#goals.visible = false;
    base.add(this.#goals);
  }

  take(content: StudyContent | null): void {
    this.#panel.hidden = content === null;
    this.#goals.visible = content?.kind === 'task';
    this.delay.seconds = content?.kind === 'task' ? content.display_latency : 0;
    this.#panel.replaceChildren();
    if (content === null) return;
    this.#say('p', content.kind === 'task' ? `${content.text} (${Math.min(content.done + 1, content.of)} of ${content.of})` : content.text);
    if (content.kind === 'task') this.#show(content.goal, content.other_goals?.[0] ?? null, content.following);
    if (content.kind === 'question') this.#ask(content);
  }

  #say(tag: 'p' | 'span', text: string, name = '', parent: HTMLElement = this.#panel): void {
    parent.append(made(tag, { className: name }, text));
  }

  #ask(content: Extract<StudyContent, { kind: 'question' }>): void {
    const answers = made('div', { className: 'answers' });
    const choices = answersOf(content);
    const words = choices.length === 2;
    if (!words) this.#say('span', content.low_text, 'end', answers);
    for (const value of choices) {
      const text = words ? (value === content.low ? content.low_text : content.high_text) : String(value);
      answers.append(made('button', { onclick: () => {
        for (const each of answers.querySelectorAll('button')) each.disabled = true; // one answer, however often it is pressed
        this.reply(content.key, value);
      } }, text));
    }
    if (!words) this.#say('span', content.high_text, 'end', answers);
    this.#panel.append(answers);
    this.#say('span', content.place, 'place');
  }

  #show(goal: StudyGoal | null, otherGoal: StudyGoal | null, following: StudyGoal | null): void {
    const place = (mesh: THREE.Mesh, at: StudyGoal | null, other: StudyGoal | null) => {
      mesh.visible = at !== null;
      if (!at) return;
      mesh.position.set(...(at.p as [number, number, number]));
      mesh.scale.setScalar(at.radius);
      // A ring faces the way to the one behind it.
      if (other) mesh.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), new THREE.Vector3(...(other.p as [number, number, number])).sub(mesh.position).normalize());
    };
    place(this.#ball, goal && !goal.gate ? goal : null, null);
    place(this.#other, otherGoal, null);
    place(this.#ring, goal?.gate ? goal : null, following);
    place(this.#next, following, goal);
  }
}
