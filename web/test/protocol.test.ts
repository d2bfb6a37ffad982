import { describe, expect, it } from 'vitest';
import Ajv from 'ajv';
import clientFixtures from '../protocol/fixtures/client.json';
import schema from '../protocol/schema.json';
import { decode, encode, type ClientMessage } from '../src/protocol';
import { examples } from './server_messages';

const client = clientFixtures as unknown as { good: ClientMessage[] };

const ajv = new Ajv();
ajv.addSchema(schema, 'protocol');
const fits = (side: 'client' | 'server', message: unknown): boolean => ajv.validate(`protocol#/definitions/${side}`, message);

describe('schema', () => {
  it('fits every good message, and none of the bad ones that are JSON', () => {
    for (const message of client.good) expect(fits('client', message), JSON.stringify(message)).toBe(true);
    for (const message of examples) expect(fits('server', message), JSON.stringify(ajv.errors)).toBe(true);
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
  it('reads every message of the server', () => {
    expect(examples.length).toBeGreaterThan(10);
    for (const message of examples) expect(decode(JSON.stringify(message))).toEqual(message);
  });

  it('takes nothing else', () => {
    for (const text of ['', '{', '7', 'null', '[]', '{}', '{"type":3}', '{"type":"other"}']) expect(decode(text), text).toBeNull();
  });

  it('writes what the server reads', () => {
    for (const message of client.good) expect(JSON.parse(encode(message))).toEqual(message);
  });
});
