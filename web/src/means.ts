/** How the operator does what the page advises. */
export interface Means { lead: string; takeOver: string; pair: string; again: string; reset: string }

export const ON_PAGE: Means = {
  lead: 'Drag the glass, or hold a key, to move the arm.', takeOver: 'Drag the glass, or hold a key, to take over.',
  pair: 'To control the arm, enter the code from the terminal.', again: 'Release, and engage again.', reset: 'press “Reset”',
};
export const ON_TOUCH: Means = { ...ON_PAGE, lead: 'Drag the glass to move the arm.', takeOver: 'Drag the glass to take over.' };
export const IN_HEADSET: Means = {
  lead: 'Squeeze the grip to move the arm.', takeOver: 'Squeeze the grip to take over.',
  pair: 'To control the arm, leave VR and enter the code.', again: 'Release, and squeeze again.', reset: 'press the thumbstick to reset',
};

/** The same, with the page's substitutes for the parts of a controller. */
export const IN_EMULATOR: Means = {
  lead: 'Squeeze the grip (hold the mouse button in the view) to move the arm.', takeOver: 'Squeeze the grip (hold the mouse button in the view) to take over.',
  pair: 'To control the arm, leave VR and enter the code.', again: 'Release, and squeeze again (the mouse button).', reset: 'press the thumbstick to reset (here: Enter)',
};
