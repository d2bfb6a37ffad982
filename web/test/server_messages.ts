import schema from '../protocol/schema.json';
import type { ServerMessage } from '../src/protocol';

/** The examples of the schema: messages as the server writes them, two of some types. */
export const examples = schema.definitions.server.anyOf.flatMap((message): unknown[] => message.examples) as ServerMessage[];
/** The first of each type. */
export const server = Object.fromEntries([...examples].reverse().map((message) => [message.type, message]));
