/** What a recorded hand is called: its name without what all of them have in common, as people write it. */
export function motionTitle(name: string): string {
  const words = name.split(/[-_ ]+/).filter((word) => word !== 'demo' && word !== 'recording').join(' ') || name;
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** What the bundled ones show. */
const SHOWS: Readonly<Record<string, string>> = {
  'carrying': 'carries things around', 'events-demo-recording': 'grabs and stretches, fast',
  'mouse-demo-recording': 'points and clicks, fast', 'physics-demo-laser': 'points, throws, fast',
};

/** Its title, and what the hand does. */
export const motionText = (name: string): string => motionTitle(name) + (SHOWS[name] ? `: ${SHOWS[name]}` : '');
