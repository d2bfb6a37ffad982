import type { ConnectionStatus } from './connection';
import type { Refusal, ServerMessage, StateMessage, WelcomeMessage } from './protocol';

/** s without a state after which the page greys out. */
export const STALE_AFTER = 0.5;

const TAKE_OVER = 'A recording leads the arm. Drag the target, or hold a key, to take over.';

/** What the page knows of the session; messages in, facts out. Knows neither the DOM nor the network. */
export class Session {
  welcome: WelcomeMessage | null = null;
  state: StateMessage | null = null;
  status: ConnectionStatus = 'connecting';
  paired = false;
  holder = 0;
  yours = false;
  lastError: { code: Refusal; message: string } | null = null;
  statesReceived = 0;
  #stateAt = -Infinity;

  connectionBecame(status: ConnectionStatus): void {
    this.status = status;
    if (status === 'open') return;
    // Whatever was true of the lease ended with the connection.
    this.paired = false;
    this.yours = false;
    this.holder = 0;
  }

  take(message: ServerMessage, now: number): void {
    switch (message.type) {
      case 'welcome': this.welcome = message; break;
      case 'state':
        this.state = message;
        this.#stateAt = now;
        ++this.statesReceived;
        break;
      case 'paired': this.paired = true; break;
      case 'lease':
        this.holder = message.holder;
        this.yours = message.yours;
        if (message.yours) this.lastError = null;
        break;
      case 'error': this.lastError = { code: message.code, message: message.message }; break;
      case 'pong': break;
    }
  }

  isStale(now: number): boolean { return now - this.#stateAt > STALE_AFTER; }

  /** Whether a way in would move the arm now. */
  mayDrive(now: number): boolean {
    const state = this.state?.state;
    return this.yours && !this.isStale(now) && (state === 'ready' || state === 'engaged' || state === 'holding');
  }

  /** What the operator may do now, in a sentence. */
  advice(now: number): string {
    if (this.status === 'refused') return this.lastError?.message ?? 'This page is of another version: reload it.';
    if (this.status !== 'open') return 'Not connected. Nothing moves. Trying again…';
    if (this.isStale(now)) return 'No news from the arm. What you see is old.';
    if (!this.paired) return 'You are watching. To drive, enter the code from the terminal.';
    if (!this.yours && this.holder) return `Client ${this.holder} drives. You are watching; you may stop the arm.`;
    const plays = (this.state?.controls.playback ?? -1) >= 0;
    switch (this.state?.state) {
      case 'idle': return 'The arm does not follow yet.';
      case 'ready':
        if (plays) return TAKE_OVER;
        return this.yours ? 'Drag the glass, or hold a key, to lead the arm.' : 'Nobody drives. Press “Drive”, or drag the target.';
      case 'engaged':
        if (plays) return TAKE_OVER;
        return this.yours ? 'The arm follows. Let go to leave it there.' : 'The arm follows a hand from elsewhere.';
      case 'holding': return plays ? TAKE_OVER : 'The arm holds. Let go and take it again.';
      case 'stopping': return 'Stopped. Press “Reset” to go on.';
      case 'fault': return 'Fault. Look at the arm, then press “Reset”.';
      default: return '';
    }
  }

  /** Which limit holds the arm back, for people; empty: none. */
  constraint(): string {
    const c = this.state?.constraint;
    if (!c) return '';
    const joint = this.welcome?.robot?.joints[c.first]?.name.replace(/_joint$/, '').replaceAll('_', ' ') ?? `joint ${c.first + 1}`;
    const spheres = this.welcome?.robot?.spheres;
    switch (c.kind) {
      case 'none': return '';
      case 'position': return `${joint} is at the end of its travel`;
      case 'velocity': return `${joint} is at its top speed`;
      case 'acceleration': return `${joint} is at its top acceleration`;
      case 'self_collision': return `${spheres?.[c.first]?.name ?? c.first} is close to ${spheres?.[c.second]?.name ?? c.second}`;
      case 'reach': return 'the target is out of reach';
    }
  }
}
