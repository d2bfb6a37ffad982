import schema from '../protocol/schema.json';
import type { ServerMessage, StateMessage } from '../src/protocol';

/** The examples of the schema: messages as the server writes them, two of some types. */
export const examples = schema.definitions.server.anyOf.flatMap((message): unknown[] => message.examples) as ServerMessage[];
/** The first of each type. */
export const server = Object.fromEntries([...examples].reverse().map((message) => [message.type, message]));

const state = server.state as StateMessage;
const COMMON: ReadonlySet<string> = new Set(['state', 'reason', 'reason_code', 'reason_leader']);

/** The example of a state with other members, also those of its only tool. */
export function stateWith(more: object): StateMessage {
  const tool = { ...state.tools[0]! }, whole = { ...state };
  for (const [name, value] of Object.entries(more)) {
    if (name in tool) Object.assign(tool, { [name]: value });
    if (!(name in tool) || COMMON.has(name)) Object.assign(whole, { [name]: value });
  }
  return { ...whole, tools: [tool] };
}
