import { describe, expect, it } from 'vitest';
import { codecOf } from '../src/camera_view';
import { Median } from '../src/median';
import { PICTURE_HEAD, pictureHead } from '../src/protocol';
import { ServerClock } from '../src/server_clock';

describe('a picture', () => {
  const message = (kind: number): ArrayBuffer => {
    const made = new ArrayBuffer(PICTURE_HEAD + 1), head = new DataView(made);
    head.setUint8(0, kind);
    head.setUint8(1, 1);
    head.setUint16(2, 258, true);
    head.setFloat64(8, 81.5, true);
    return made;
  };
  it('says of which camera it is, and when it was exposed', () => {
    expect(pictureHead(message(1))).toEqual({ camera: 258, isKey: true, exposed: 81.5 });
  });
  it('that is cut off or of another kind is none', () => {
    expect([pictureHead(message(2)), pictureHead(new ArrayBuffer(PICTURE_HEAD)), pictureHead(new ArrayBuffer(0))]).toEqual([null, null, null]);
  });
  it('names its codec where it brings the parameters', () => {
    expect(codecOf(new Uint8Array([0, 0, 0, 1, 0x09, 0xf0, 0, 0, 0, 1, 0x67, 0x64, 0x00, 0x0d, 0xac]))).toBe('avc1.64000d');
    expect(codecOf(new Uint8Array([0, 0, 1, 0x41, 0x9a, 1, 2, 3]))).toBeNull();
    expect(codecOf(new Uint8Array([0, 0, 1, 0x67]))).toBeNull();
  });
});

describe('the session’s clock', () => {
  it('is known by the ping that came back soonest, and is off by half of its round trip at most', () => {
    const clock = new ServerClock();
    expect(clock.at(1)).toBeNaN();
    clock.take({ t_s: 1, now_s: 101.3 }, 1.4); // 0.3 s there, 0.1 s back
    expect([clock.at(2), clock.uncertainty]).toEqual([expect.closeTo(102.1), expect.closeTo(0.2)]);
    clock.take({ t_s: 2, now_s: 102.01 }, 2.02);
    clock.take({ t_s: 3, now_s: 103.5 }, 3.6);
    expect([clock.at(4), clock.uncertainty]).toEqual([expect.closeTo(104), expect.closeTo(0.01)]);
  });
  it('is followed: what was measured long ago does not count', () => {
    const clock = new ServerClock();
    clock.take({ t_s: 0, now_s: 100 }, 0.002);
    for (let t = 0.5; t < 12; t += 0.5) clock.take({ t_s: t, now_s: t + 105.05 }, t + 0.1);
    expect(clock.at(12)).toBeCloseTo(117);
    clock.forget();
    expect(clock.at(12)).toBeNaN();
    clock.take({ t_s: 13, now_s: 20.5 }, 14);
    expect(clock.at(14)).toBeCloseTo(21);
  });
});

describe('a median', () => {
  it('is of the newest', () => {
    const median = new Median(3);
    expect(median.value()).toBeNaN();
    median.add(NaN);
    median.add(5);
    median.add(1);
    expect(median.value()).toBe(3);
    for (const value of [7, 8, 9]) median.add(value);
    expect(median.value()).toBe(8);
    median.clear();
    expect(median.value()).toBeNaN();
  });
});
