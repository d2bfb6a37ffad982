import type { Busy } from './busy';
import { made, press } from './element';

/** The actions on a recording. */
export type Change = 'label' | 'rename' | 'delete';

/** As session_edits.cpp takes it. */
const NAME = /^[A-Za-z0-9_-][A-Za-z0-9._-]{0,127}$/;
const NAME_RULE = 'Letters, digits, “-”, “_” and “.”, which is not first.';

/** Why a recording cannot be called so; empty: it can. */
export const whyNoName = (name: string): string => (NAME.test(name) ? '' : `“${name}” is no name for a file.`);

/** The text being typed: it is kept when the list is made again. */
export interface Edit { name: string; label: string; to: string; refusal: string; sure: boolean }

export const editOf = (name: string, label = ''): Edit => ({ name, label, to: name, refusal: '', sure: false });

/** The changed fields of the form. */
export function changesOf({ name, label, to }: Edit, before: string): [Change, string][] {
  const changes: [Change, string][] = [];
  if (label.trim() !== before) changes.push(['label', label.trim()]);
  if (to.trim() !== name) changes.push(['rename', to.trim()]); // last: then it has another name
  return changes;
}

export interface Acts { save(changes: [Change, string][]): void; cancel(): void; remove(): void }

/**
 * A form for a recording's label and name; shows invalid input next to it.
 * @param before its label @param called its name for people
 */
export function editForm(edit: Edit, before: string, called: string, busy: Busy, acts: Acts): HTMLFormElement {
  const form = made('form', { className: 'edit' });
  const key = `change ${edit.name}`;
  const field = (text: string, value: string, take: (value: string) => void): HTMLInputElement => {
    const input = made('input', { type: 'text', value, maxLength: 120, oninput: () => take(input.value) });
    form.append(made('label', {}, `${text} `, input));
    return input;
  };
  const hint = (textContent: string, className: string, hidden = false): HTMLParagraphElement => form.appendChild(made('p', { textContent, className: `hint ${className}`, hidden }));
  field('Label', edit.label, (value) => { edit.label = value; });
  const named = field('Name of the file', edit.to, (value) => { edit.to = value; });
  const rule = hint(NAME_RULE, 'rule');
  rule.id = 'edit-rule';
  named.setAttribute('aria-describedby', rule.id);
  const refusal = hint(edit.refusal, 'refusal', edit.refusal === '');
  refusal.setAttribute('role', 'alert');
  hint('Space stops the arm while it moves.', 'space', true).setAttribute('role', 'status');
  const load = made('a', { href: `./sessions/${encodeURIComponent(edit.name)}/session.mcap`, download: `${edit.name}.mcap`, ariaLabel: `Download ${edit.name} as MCAP` }, 'Download');
  form.append(made('div', { className: 'row' }, busy.sign(made('button', {}, 'Save'), key, 'Saving…'), press('Cancel', `Leave ${edit.name} as it is`, acts.cancel), load, busy.sign(surely(called, edit, acts.remove), key, 'Deleting…')));
  form.onsubmit = (event) => {
    event.preventDefault();
    const changes = changesOf(edit, before);
    edit.refusal = edit.to.trim() === edit.name ? '' : whyNoName(edit.to.trim());
    refusal.textContent = edit.refusal;
    refusal.hidden = edit.refusal === '';
    if (edit.refusal) return named.focus();
    if (changes.length === 0) acts.cancel(); else acts.save(changes);
  };
  return form;
}

/** ms for which a second press deletes. */
const SURE_FOR = 15_000;

/** A button that asks for confirmation. @param called the name of the recording to delete */
export function surely(called: string, asked: { sure: boolean }, act: () => void): HTMLButtonElement {
  const gone = made('button', { type: 'button' });
  const show = (): void => {
    gone.textContent = asked.sure ? `Really delete “${called}”` : 'Delete';
    gone.setAttribute('aria-label', asked.sure ? `Really delete ${called}, for good` : `Delete ${called}`);
    if (asked.sure) gone.dataset.sure = 'true'; else delete gone.dataset.sure;
  };
  gone.onclick = () => {
    if (asked.sure) return act();
    asked.sure = true;
    show();
    gone.scrollIntoView({ block: 'nearest' }); // it has its own line now
    setTimeout(() => {
      asked.sure = false;
      show();
    }, SURE_FOR);
  };
  show();
  return gone;
}
