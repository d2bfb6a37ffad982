import * as THREE from 'three';

/** The state as a board beside the arm, readable in the headset. Drawn anew only when its words change. */
export class Board extends THREE.Mesh<THREE.PlaneGeometry, THREE.MeshBasicMaterial> {
  readonly #context: CanvasRenderingContext2D;
  /** What stands on it, a line each. */
  text = '';
  #color = '';

  constructor() {
    const canvas = document.createElement('canvas');
    canvas.width = 1024;
    canvas.height = 512;
    const map = new THREE.CanvasTexture(canvas);
    map.colorSpace = THREE.SRGBColorSpace;
    super(new THREE.PlaneGeometry(0.72, 0.36), new THREE.MeshBasicMaterial({ map, transparent: true, toneMapped: false }));
    this.#context = canvas.getContext('2d')!;
  }

  write(title: string, color: string, warning: string, lines: string[]): void {
    const text = [title, ...lines, warning].join('\n');
    if (text === this.text && color === this.#color) return;
    this.text = text;
    this.#color = color;
    const c = this.#context;
    c.clearRect(0, 0, 1024, 512);
    c.fillStyle = 'rgba(16, 20, 25, 0.9)';
    c.beginPath();
    c.roundRect(0, 0, 1024, 512, 44);
    c.fill();
    c.fillStyle = color;
    c.beginPath();
    c.arc(84, 88, 30, 0, 2 * Math.PI);
    c.fill();
    c.font = '650 84px system-ui, sans-serif';
    c.fillText(title, 142, 118);
    c.font = '44px system-ui, sans-serif';
    lines.forEach((line, i) => {
      c.fillStyle = i === 0 ? '#c4ccd6' : '#e8edf3';
      c.fillText(line, 56, 200 + 64 * i, 920);
    });
    if (warning) {
      c.fillStyle = '#e0a100';
      c.beginPath();
      c.roundRect(40, 412, 944, 76, 20);
      c.fill();
      c.fillStyle = '#1a1d21';
      c.font = '600 44px system-ui, sans-serif';
      c.fillText(`⚠ ${warning}`, 64, 464, 900);
    }
    this.material.map!.needsUpdate = true;
  }
}
