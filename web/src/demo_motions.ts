/** What a recorded hand is called: its name without what all of them have in common, as people write it. */
export function motionTitle(name: string): string {
  const words = name.split(/[-_ ]+/).filter((word) => word !== 'demo' && word !== 'recording').join(' ') || name;
  return words.charAt(0).toUpperCase() + words.slice(1);
}
