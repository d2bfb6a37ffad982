/** Title of a recorded hand: its name without the part that all names share, as normal text. */
export function motionTitle(name: string): string {
  const words = name.split(/[-_ ]+/).filter((word) => word !== 'demo' && word !== 'recording').join(' ') || name;
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** Purpose of each bundled motion. */
const SHOWS: Readonly<Record<string, string>> = {
  'carrying': 'carries things around', 'events-demo-recording': 'grabs and stretches, fast',
  'mouse-demo-recording': 'points and clicks, fast', 'physics-demo-laser': 'points, throws, fast',
};

/** Its title, and the motion of the hand. */
export const motionText = (name: string): string => motionTitle(name) + (SHOWS[name] ? `: ${SHOWS[name]}` : '');
