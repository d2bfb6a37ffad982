import { describe, expect, it } from 'vitest';
import clientFixtures from '../protocol/fixtures/client.json';
import server from '../protocol/fixtures/server.json';
import { decode, encode, type ClientMessage, type StateMessage } from '../src/protocol';

const client = clientFixtures as unknown as { good: ClientMessage[] };

describe('protocol', () => {
  it('reads every message of the shared fixtures', () => {
    for (const [name, message] of Object.entries(server)) {
      expect(decode(JSON.stringify(message)), name).toEqual(message);
    }
  });

  it('keeps unknown measures as null rather than a number', () => {
    const state = decode(JSON.stringify(server.state)) as StateMessage;
    expect(state.liquid.freeboard).toBeNull();
  });

  it('takes nothing else', () => {
    for (const text of ['', '{', '7', 'null', '[]', '{}', '{"type":3}', '{"type":"other"}']) expect(decode(text), text).toBeNull();
  });

  it('writes what the server reads', () => {
    for (const message of client.good) expect(JSON.parse(encode(message))).toEqual(message);
  });
});
