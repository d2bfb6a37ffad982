import { describe, expect, it } from 'vitest';
import { itemsOf } from '../src/input/menu';
import type { ServerMessage } from '../src/protocol';
import { Session } from '../src/session';
import { server, stateWith } from './server_messages';

describe('menu of the headset', () => {
  it('fills the glass once it spilled', () => {
    const session = new Session(), asked: string[] = [], asks = { command: (kind: string) => { asked.push(kind); }, reset: () => {}, recentre: () => {}, swap: () => {} };
    session.connectionBecame('open');
    session.take(server.welcome!, 0);
    session.paired = session.yours = true;
    const see = (spilled: boolean) => session.take(stateWith({ state: 'ready', liquid: { tilt: [0, 0], freeboard: 0.01, spilled, spilled_share: spilled ? 0.1 : 0, least_freeboard: 0, lateral: 0 } }), 1);
    const fill = () => itemsOf(session, asks).find(({ label }) => label === 'Fill the glass');
    see(false);
    expect(fill()).toBeUndefined();
    see(true);
    fill()!.act();
    expect(asked).toEqual(['refill']);
  });

  it('begins, judges and sets up as the page does', () => {
    const session = new Session(), asked: unknown[] = [], asks = { command: (kind: string, more: object) => { asked.push({ kind, ...more }); }, reset: () => {}, recentre: () => {}, swap: () => {} };
    session.connectionBecame('open');
    session.paired = session.yours = true;
    const see = (task: boolean, recording: boolean, episode: object) => {
      session.take({ ...server.welcome!, ...(task ? {} : { task: null }) } as ServerMessage, 0);
      session.take(stateWith({ recording, episode: { running: false, number: 0, time: 0, kept: 0, discarded: 0, lost: 0, success: null, ...episode } }), 1);
      session.paired = session.yours = true;
    };
    const row = () => itemsOf(session, asks).filter(({ row }) => row.startsWith('Episode'));
    const labels = () => row().map(({ label }) => label);
    const hasScene = () => itemsOf(session, asks).some(({ label }) => label === 'New scene');
    see(false, false, {});
    expect([labels(), hasScene()]).toEqual([[], false]);
    see(false, true, {});
    expect([labels(), hasScene()]).toEqual([['Begin'], false]);
    see(true, true, { running: true, number: 1 });
    expect([labels(), hasScene()]).toEqual([['Keep', 'Success', 'Failure', 'Discard'], false]);
    row().forEach(({ act }) => act());
    see(true, true, { number: 1, kept: 1, success: false });
    expect([labels(), hasScene()]).toEqual([['Begin', 'Keep', 'Success', 'Failure', 'Discard'], true]);
    expect([row()[0]!.row, row().filter(({ on }) => on).map(({ label }) => label)]).toEqual(['Episodes: 1 kept', ['Failure']]);
    row()[0]!.act();
    itemsOf(session, asks).find(({ label }) => label === 'New scene')!.act();
    expect(asked).toEqual([
      { kind: 'episode', text: 'keep' }, { kind: 'episode', text: 'keep', success: true }, { kind: 'episode', text: 'keep', success: false },
      { kind: 'episode', text: 'discard' }, { kind: 'episode', text: 'begin' }, { kind: 'set_up' },
    ]);
  });
});
