import { describe, expect, it } from 'vitest';
import { Glass } from '../src/scene/glass';
import { type Picture, Thrift } from '../src/scene/thrift';

/** The answers to a browser that asks 60 times a second, if each frame takes so long. */
function draw(thrift: Thrift, seconds: number, takes: number, moves: (t: number) => boolean, from = 0): Picture[] {
  const drawn: Picture[] = [];
  let until = -1;
  for (let t = from; t < from + seconds; t += 1 / 60) {
    if (moves(t)) thrift.wake(t);
    const picture = thrift.next(t, t < until, true);
    if (picture === 'none') continue;
    drawn.push(picture);
    until = t + takes;
  }
  return drawn;
}

describe('Thrift', () => {
  it('draws every picture where a graphics card does it', () => {
    expect(draw(new Thrift(false), 2, 0, () => true).length).toBeGreaterThanOrEqual(119);
  });

  it('draws some 20 a second in software, and fewer where each takes long or plans are late', () => {
    const inSoftware = (seconds: number, takes: number, late: boolean): number => {
      const thrift = new Thrift(true);
      if (late) thrift.late(0);
      return draw(thrift, seconds, takes, () => true).length;
    };
    const near = (count: number, wanted: number): void => expect(Math.abs(count - wanted)).toBeLessThanOrEqual(0.12 * wanted);
    near(inSoftware(4, 0.01, false), 80);
    near(inSoftware(6, 0.1, false), 36); // a third of the time is left to others
    near(inSoftware(4, 0.01, true), 40);
    near(inSoftware(6, 0.1, true), 18); // two thirds
    expect(inSoftware(12, 1, true)).toBeGreaterThanOrEqual(9); // but no frame waits for long
  });

  it('spares for a while where plans are late', () => {
    const thrift = new Thrift(false);
    thrift.late(0);
    expect(draw(thrift, 4, 0, () => true).length).toBeLessThanOrEqual(41);
    expect(thrift.spares).toBe(true);
    expect(draw(thrift, 2, 0, () => true, 30).length).toBeGreaterThanOrEqual(119);
  });

  it('draws one sharp picture of a scene that stands, and the usual ones from the first motion on', () => {
    const thrift = new Thrift(true), still = draw(thrift, 20, 0.05, (t) => t < 1);
    expect(still.filter((picture) => picture === 'sharp')).toHaveLength(1);
    expect(still.at(-1)).toBe('sharp');
    expect(draw(thrift, 1, 0.05, () => true, 20)[0]).toBe('usual');
  });

  it('draws at once where there is no picture, whatever is under way', () => {
    const thrift = new Thrift(true);
    thrift.next(0, false, true);
    expect(thrift.next(0.02, true, true)).toBe('none');
    thrift.blank(0.03);
    expect([thrift.next(0.04, true, true), thrift.next(0.05, true, true)]).toEqual(['usual', 'none']);
  });

  it('waits for a frame in which the page does nothing else, but not for long', () => {
    const first = (thrift: Thrift): Picture[] => [0, 0.02, 0.04].map((t) => (thrift.wake(t), thrift.next(t, false, true, true)));
    expect(first(new Thrift(true))).toEqual(['none', 'none', 'usual']);
    expect(first(new Thrift(false))).toEqual(['usual', 'usual', 'usual']);
    const slow = new Thrift(true); // a page that has something to do in each of its frames
    let drawn = 0;
    for (let t = 0; t < 5; t += 0.1) {
      slow.wake(t);
      if (slow.next(t, false, true, true) !== 'none') ++drawn;
    }
    expect(drawn).toBe(25);
  });

  it('takes for motion what can be seen, and no noise', () => {
    const thrift = new Thrift(true);
    thrift.look([0, 1], 0);
    expect(thrift.next(2, false, true)).toBe('sharp');
    thrift.next(2.05, false, true);
    thrift.look([1e-5, 1 - 1e-5], 3);
    expect(thrift.next(3, false, true)).toBe('none');
    thrift.look([1e-3, 1], 4);
    expect(thrift.next(4, false, true)).toBe('usual');
  });

  it('does not wait until the last of a wave is over', () => {
    const { liquid } = new Glass(), thrift = new Thrift(true), radius = 0.035;
    liquid.fit({ radius, height: 0.1, fill: 0.08 });
    const after = (tilt: number, t: number): Picture => {
      liquid.tilt(tilt, 0);
      thrift.look(liquid.surface, t);
      const picture = thrift.next(t, false, true);
      thrift.next(t + 0.05, false, true); // it is done
      return picture;
    };
    after(0, 0);
    expect(after(0, 2)).toBe('sharp');
    expect(after(2e-4 / radius, 4)).toBe('none');
    expect(after(5e-4 / radius, 6)).toBe('usual');
  });
});
