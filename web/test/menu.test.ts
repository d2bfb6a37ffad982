import { describe, expect, it } from 'vitest';
import fixtures from '../protocol/fixtures/server.json';
import { itemsOf } from '../src/input/menu';
import type { ServerMessage } from '../src/protocol';
import { Session } from '../src/session';

const server = fixtures as unknown as Record<string, ServerMessage>;

describe('menu of the headset', () => {
  it('fills the glass once it spilled', () => {
    const session = new Session(), asked: string[] = [], asks = { command: (kind: string) => { asked.push(kind); }, reset: () => {}, recentre: () => {} };
    session.connectionBecame('open');
    session.take(server.welcome!, 0);
    session.paired = session.yours = true;
    const see = (spilled: boolean) => session.take({ ...server.state!, state: 'ready', liquid: { tilt: [0, 0], freeboard: 0.01, spilled, spilled_share: spilled ? 0.1 : 0, least_freeboard: 0, lateral: 0 } } as ServerMessage, 1);
    const fill = () => itemsOf(session, asks).find(({ label }) => label === 'Fill the glass');
    see(false);
    expect(fill()).toBeUndefined();
    see(true);
    fill()!.act();
    expect(asked).toEqual(['refill']);
  });
});
