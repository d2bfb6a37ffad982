/** How the operator does what the page advises. */
export interface Means { lead: string; takeOver: string; pair: string; again: string; reset: string }

export const ON_PAGE: Means = {
  lead: 'Drag the glass, or hold a key, to lead the arm.', takeOver: 'Drag the glass, or hold a key, to take over.',
  pair: 'To drive, enter the code from the terminal.', again: 'Let go, and take hold again.', reset: 'press “Reset”',
};
export const ON_TOUCH: Means = { ...ON_PAGE, lead: 'Drag the glass to lead the arm.', takeOver: 'Drag the glass to take over.' };
export const IN_HEADSET: Means = {
  lead: 'Squeeze the grip to lead the arm.', takeOver: 'Squeeze the grip to take over.',
  pair: 'To drive, leave VR and enter the code.', again: 'Let go, and squeeze again.', reset: 'press the thumbstick to reset',
};

/** The same with what stands for a controller's parts on this page. */
export const IN_EMULATOR: Means = {
  lead: 'Squeeze the grip (hold the mouse button in the picture) to lead the arm.', takeOver: 'Squeeze the grip (hold the mouse button in the picture) to take over.',
  pair: 'To drive, leave VR and enter the code.', again: 'Let go, and squeeze again (the mouse button).', reset: 'press the thumbstick to reset (here: Enter)',
};
