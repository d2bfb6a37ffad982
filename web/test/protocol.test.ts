import { describe, expect, it } from 'vitest';
import Ajv from 'ajv';
import clientFixtures from '../protocol/fixtures/client.json';
import server from '../protocol/fixtures/server.json';
import schema from '../protocol/schema.json';
import { decode, encode, type ClientMessage, type StateMessage } from '../src/protocol';

const client = clientFixtures as unknown as { good: ClientMessage[] };

const ajv = new Ajv();
ajv.addSchema(schema, 'protocol');
const fits = (side: 'client' | 'server', message: unknown): boolean => ajv.validate(`protocol#/definitions/${side}`, message);

describe('schema', () => {
  it('fits every good message, and none of the bad ones that are JSON', () => {
    for (const message of client.good) expect(fits('client', message), JSON.stringify(message)).toBe(true);
    for (const message of Object.values(server)) expect(fits('server', message), JSON.stringify(ajv.errors)).toBe(true);
    let refused = 0;
    for (const { text, schema_accepts } of clientFixtures.bad as { text: string; schema_accepts?: boolean }[]) {
      let message: unknown;
      try { message = JSON.parse(text); } catch { continue; }
      if (text.includes('1e999')) continue; // infinite here
      expect(fits('client', message), text).toBe(schema_accepts ?? false); // no schema can say that a quaternion has norm 1
      ++refused;
    }
    expect(refused).toBeGreaterThan(10);
  });
});

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
