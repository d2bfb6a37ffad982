// The site after its first visit, without a network. `./steadyhand site` writes the list of its files above: another
// list is another site, which takes over once no page of this one is open.
const name = `steadyhand ${version}`;

addEventListener('install', (event) => event.waitUntil(caches.open(name).then((cache) => cache.addAll(files))));

addEventListener('activate', (event) => event.waitUntil(caches.keys().then((all) =>
  Promise.all(all.filter((each) => each.startsWith('steadyhand ') && each !== name).map((each) => caches.delete(each))))));

addEventListener('fetch', (event) => {
  if (event.request.method !== 'GET' || !event.request.url.startsWith(registration.scope)) return;
  event.respondWith(caches.open(name).then((cache) => cache.match(event.request, { ignoreSearch: true }))
    .then((kept) => kept ?? fetch(event.request)));
});
