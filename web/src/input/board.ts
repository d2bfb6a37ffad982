import * as THREE from 'three';
import type { Item } from './menu';

/** px of the canvas, and m of the board. */
const WIDTH = 1024, HEIGHT = 1300, METRES = 0.72;
const LABELS = '34px system-ui, sans-serif';
const LINE = 53, MENU = 546, ROW = 34, BUTTON = 60, LEFT = 56, GAP = 14, END = 76;
/** px: the bar by which the board is moved, as windows in headsets have one. */
const HANDLE = { width: 300, height: 12, up: 28 } as const;

/** Position of an item, px from the top left. */
interface Place { x: number; y: number; width: number; height: number }

function panel(width: number, height: number, metres: number): { canvas: HTMLCanvasElement; geometry: THREE.PlaneGeometry; material: THREE.MeshBasicMaterial } {
  const canvas = document.createElement('canvas');
  canvas.width = width;
  canvas.height = height;
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  return { canvas, geometry: new THREE.PlaneGeometry(metres, (metres * height) / width), material: new THREE.MeshBasicMaterial({ map, transparent: true, toneMapped: false }) };
}

/** Wraps the text into lines; in `c`'s font. @param wide px */
function wrapped(text: string, wide: number, c: CanvasRenderingContext2D): string[] {
  const lines: string[] = [];
  for (const word of text.split(' ').filter(Boolean)) {
    const longer = lines.length > 0 ? `${lines.at(-1)!} ${word}` : word;
    if (lines.length > 0 && c.measureText(longer).width <= wide) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

/** State, what to do now, and a menu, as a board in the headset. Redrawn only when something on it changes. */
export class Board extends THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial> {
  readonly #context: CanvasRenderingContext2D;
  /** The text above the menu, by lines. */
  text = '';
  items: Item[] = [];
  /** Which item the ray or the stick is on; -1: none. */
  chosen = -1;
  /** m, in the board's frame: its lower edge. */
  bottom = 0;
  #shown = '';
  #places: Place[] = [];

  constructor() {
    const { canvas, geometry, material } = panel(WIDTH, HEIGHT, METRES);
    super(geometry, material);
    this.#context = canvas.getContext('2d')!;
  }

  /** The item at a point of the board (coordinates 0 to 1, upwards); -1: none. */
  itemAt(u: number, v: number): number {
    const x = u * WIDTH, y = (1 - v) * HEIGHT;
    return this.#places.findIndex((place) => x >= place.x && x <= place.x + place.width && y >= place.y && y <= place.y + place.height);
  }

  write(title: string, color: string, warning: string, lines: string[], items: Item[]): void {
    this.text = [title, ...lines, warning].join('\n');
    // Another item may now precede the chosen one: the choice follows the item, not its number.
    const kept = this.items[this.chosen], same = kept ? items.findIndex(({ row, label }) => row === kept.row && label === kept.label) : -1;
    this.items = items;
    if (same >= 0) this.chosen = same;
    else if (this.chosen >= items.length) this.chosen = -1;
    const shown = [this.text, color, this.chosen, ...items.map(({ row, label, on }) => `${row}/${label}/${on}`)].join('\n');
    if (shown === this.#shown) return;
    this.#shown = shown;
    const c = this.#context, wide = WIDTH - 2 * LEFT;
    const end = this.#lay();
    this.bottom = this.geometry.parameters.height * (0.5 - end / HEIGHT);
    c.clearRect(0, 0, WIDTH, HEIGHT);
    c.fillStyle = 'rgba(16, 20, 25, 0.92)';
    c.beginPath();
    c.roundRect(0, 0, WIDTH, end, 44);
    c.fill();
    c.fillStyle = color;
    c.beginPath();
    c.arc(84, 88, 30, 0, 2 * Math.PI);
    c.fill();
    c.font = '650 84px system-ui, sans-serif';
    c.fillText(title, 142, 118, WIDTH - 142 - LEFT);
    const above = this.#warn(warning);
    let y = 188;
    lines.forEach((line, i) => {
      c.font = i === 1 ? '600 50px system-ui, sans-serif' : '40px system-ui, sans-serif';
      c.fillStyle = i === 1 ? '#ffffff' : '#c4ccd6';
      for (const part of wrapped(line, wide, c)) {
        if (y > above) return; // the last lines (figures) give way to a long reason
        c.fillText(part, LEFT, y, wide);
        y += LINE;
      }
    });
    this.#drawMenu();
    if (items.length > 0) this.#drawHandle(end);
    this.material.map!.needsUpdate = true;
  }

  /** Just above the menu. @returns px, above which everything else must stay */
  #warn(warning: string): number {
    if (!warning) return MENU - 24;
    const c = this.#context;
    c.font = '600 40px system-ui, sans-serif';
    const lines = wrapped(`⚠ ${warning}`, WIDTH - 124, c), top = MENU - 44 - LINE * lines.length;
    c.fillStyle = '#e0a100';
    c.beginPath();
    c.roundRect(40, top, WIDTH - 80, 23 + LINE * lines.length, 20);
    c.fill();
    c.fillStyle = '#1a1d21';
    lines.forEach((line, i) => c.fillText(line, 64, top + 50 + LINE * i, WIDTH - 124));
    return top - 12;
  }

  /** Row by row, each on as many lines as needed. @returns px, where the menu ends */
  #lay(): number {
    const c = this.#context;
    let row = '', y = MENU - BUTTON - GAP, x = LEFT;
    c.font = LABELS;
    this.#places = this.items.map((item) => {
      const width = Math.min(c.measureText(item.label).width + 48, WIDTH - 2 * LEFT);
      const begins = item.row !== row;
      if (begins || x + width > WIDTH - LEFT) {
        y += BUTTON + GAP + (begins ? ROW : 0);
        x = LEFT;
      }
      row = item.row;
      const place = { x, y, width, height: BUTTON };
      x += width + GAP;
      return place;
    });
    return Math.min(HEIGHT, this.items.length > 0 ? y + BUTTON + END : MENU);
  }

  /** Everything except the buttons moves the board; the handle shows this. @param end px, of the board */
  #drawHandle(end: number): void {
    const c = this.#context, { width, height, up } = HANDLE;
    c.fillStyle = '#9aa6b4';
    c.beginPath();
    c.roundRect((WIDTH - width) / 2, end - up, width, height, height / 2);
    c.fill();
    c.font = '28px system-ui, sans-serif';
    c.textAlign = 'center';
    c.fillText('hold here to move the board', WIDTH / 2, end - up - 14);
    c.textAlign = 'start';
  }

  #drawMenu(): void {
    const c = this.#context;
    this.items.forEach((item, i) => {
      const { x, y, width, height } = this.#places[i]!;
      if (item.row !== this.items[i - 1]?.row) {
        c.font = '30px system-ui, sans-serif';
        c.fillStyle = '#9aa6b4';
        c.fillText(item.row, LEFT, y - 12);
      }
      c.font = item.on ? `600 ${LABELS}` : LABELS;
      c.fillStyle = item.on ? '#d5dee8' : '#2a323c';
      c.beginPath();
      c.roundRect(x, y, width, height, 16);
      c.fill();
      if (i === this.chosen) {
        c.lineWidth = 6;
        c.strokeStyle = '#ffffff';
        c.stroke();
      }
      c.fillStyle = item.on ? '#14181d' : '#e8edf3';
      c.fillText(item.label, x + 24, y + 42, width - 40);
    });
  }
}

/** px of the canvas, for the longest line. */
const ACROSS = 896;

/** A few words before the eyes or at a controller. Redrawn when they change; hidden when there are none. */
export class Words extends THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial> {
  readonly #canvas: HTMLCanvasElement;
  #lines = '';

  constructor(private readonly background: string, private readonly ink: string, rows: number, metres: number) {
    const { canvas, geometry, material } = panel(ACROSS, 40 + 66 * rows, metres);
    super(geometry, material);
    this.#canvas = canvas;
    this.visible = false;
  }

  get lines(): string { return this.#lines; }

  /** @param lines one each; none: nothing is shown */
  say(lines: readonly string[]): void {
    const text = lines.join('\n');
    this.visible = text !== '';
    if (text === this.#lines) return;
    this.#lines = text;
    const c = this.#canvas.getContext('2d')!, { width, height } = this.#canvas;
    c.clearRect(0, 0, width, height);
    if (!text) return;
    c.fillStyle = this.background;
    c.beginPath();
    c.roundRect(0, 0, width, 40 + 66 * lines.length, 32);
    c.fill();
    c.fillStyle = this.ink;
    c.font = '600 48px system-ui, sans-serif';
    lines.forEach((line, i) => c.fillText(line, 36, 74 + 66 * i, width - 72));
    this.material.map!.needsUpdate = true;
  }
}
