// For pages opened as files, where browsers start no workers: that of the search runs in a frame of the page.
if (location.protocol === 'file:') {
  window.Worker = class extends EventTarget {
    #frame = document.createElement('iframe');
    #started;
    constructor(url) {
      super();
      this.#frame.hidden = true;
      document.documentElement.append(this.#frame);
      const inside = this.#frame.contentWindow, script = inside.document.createElement('script');
      inside.postMessage = (data) => this.dispatchEvent(new MessageEvent('message', { data }));
      this.#started = new Promise((started) => { script.onload = started; });
      script.src = new URL(url, location.href);
      inside.document.head.append(script);
    }
    async postMessage(data) {
      await this.#started;
      this.#frame.contentWindow.dispatchEvent(new MessageEvent('message', { data }));
    }
    terminate() { this.#frame.remove(); }
  };
}
