/** Gets a file of the site. Throws a message for users: what is missing or wrong, and what to do. */
export async function file(url: URL, what: string, type?: string): Promise<Response> {
  const name = url.pathname.split('/').pop() ?? url.pathname;
  const answer = await fetch(url).catch(() => null);
  if (!answer) throw new Error(`${what} (${name}) could not be loaded: check the network. The page tries again.`);
  if (!answer.ok) throw new Error(`${what} (${name}) is missing on the server (${answer.status}): publish all files of the site's folder again.`);
  const given = (answer.headers.get('content-type') ?? '').split(';')[0]!.trim();
  if (type && given && given !== type && given !== 'application/octet-stream' && given.startsWith('text/')) {
    throw new Error(`${what} (${name}) has type ${given} instead of ${type}: check the server's configuration.`);
  }
  return answer;
}

/** Throws if the length differs from that in the site's list. */
export function whole(bytes: ArrayBuffer, expected: number | undefined, what: string): ArrayBuffer {
  if (expected !== undefined && bytes.byteLength !== expected) {
    throw new Error(`${what} is cut short: ${bytes.byteLength} of ${expected} bytes. Publish all files of the site's folder again.`);
  }
  return bytes;
}
