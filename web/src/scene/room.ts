import * as THREE from 'three';

/** m, height of the pedestal under the arm. */
export const TABLE = 0.75;
/** m, position of its axis. */
const BEHIND = -0.75;
/** Facets of the pedestal, about its axis and along its curve: errors of at most 1 mm. */
const AROUND = 48, ALONG = 21;

const VERTEX = `
varying vec2 place;
void main() {
  place = position.xy;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

/**
 * Lines 25 cm apart, every fourth stronger, one pixel wide at any distance; the floor fades out before its edge is
 * seen.
 */
const FRAGMENT = `
uniform vec3 ground, ink;
varying vec2 place;
float lines(float step) {
  vec2 cell = place / step, width = max(fwidth(cell), 1e-5);
  vec2 off = abs(fract(cell - 0.5) - 0.5) / width;
  // Where lines come closer than pixels they melt into one tone.
  return (1.0 - min(min(off.x, off.y), 1.0)) * clamp(1.4 - 3.0 * max(width.x, width.y), 0.0, 1.0);
}
void main() {
  float line = max(0.45 * lines(0.25), lines(1.0));
  float fade = 1.0 - smoothstep(1.2, 4.6, length(place));
  gl_FragColor = vec4(mix(ground, ink, 0.55 * line), fade);
  #include <colorspace_fragment>
}`;

/** Floor and pedestal: hidden in augmented reality. */
export class Room extends THREE.Group {
  readonly #floor: THREE.ShaderMaterial;
  readonly #pedestal: THREE.MeshStandardMaterial | THREE.MeshLambertMaterial;
  readonly #column: THREE.Mesh;
  readonly #shadow = new THREE.ShadowMaterial({ opacity: 0.26 });
  /** Receives shadows. */
  readonly #screen: THREE.Mesh;

  /** @param software software rendering: a simpler lighting model */
  constructor(software: boolean) {
    super();
    this.#pedestal = software ? new THREE.MeshLambertMaterial() : new THREE.MeshStandardMaterial({ roughness: 0.42, metalness: 0.1 });
    this.#floor = new THREE.ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, transparent: true, depthWrite: false,
      uniforms: { ground: { value: new THREE.Color() }, ink: { value: new THREE.Color() } },
    });
    const plane = new THREE.PlaneGeometry(10, 10);
    const floor = new THREE.Mesh(plane, this.#floor);
    const shadow = this.#screen = new THREE.Mesh(plane, this.#shadow);
    shadow.receiveShadow = true;
    shadow.position.z = 0.001;
    floor.renderOrder = -2;
    shadow.renderOrder = -1;
    const ground = new THREE.Group();
    ground.add(floor, shadow);
    ground.rotateX(-Math.PI / 2);
    ground.position.z = BEHIND;

    // A column that widens smoothly into its foot and its plate.
    const outline = [[0, 0], [0.235, 0], [0.25, 0.006], [0.25, 0.02], [0.24, 0.028], [0.15, 0.05], [0.115, 0.1], [0.1, 0.2], [0.095, 0.45],
      [0.1, 0.62], [0.115, 0.705], [0.128, 0.728], [0.132, 0.734], [0.132, 0.745], [0.128, TABLE], [0, TABLE]];
    const profile = new THREE.SplineCurve(outline.slice(4, 12).map(([x, y]) => new THREE.Vector2(x, y))).getPoints(ALONG);
    const turned = [...outline.slice(0, 4).map(([x, y]) => new THREE.Vector2(x, y)), ...profile,
      ...outline.slice(12).map(([x, y]) => new THREE.Vector2(x, y))];
    this.#column = new THREE.Mesh(new THREE.LatheGeometry(turned, AROUND), this.#pedestal);
    this.#column.position.z = BEHIND;
    this.#column.castShadow = this.#column.receiveShadow = true;
    this.add(ground, this.#column);
  }

  /** @param shown whether there are shadows; without them the plane would only cost pixels */
  showShadows(shown: boolean): void { this.#screen.visible = shown; }

  showPedestal(shown: boolean): void { this.#column.visible = shown; }

  setDark(dark: boolean): void {
    (this.#floor.uniforms.ground!.value as THREE.Color).setHex(dark ? 0x1b2027 : 0xe3e8ee);
    (this.#floor.uniforms.ink!.value as THREE.Color).setHex(dark ? 0x566373 : 0x94a3b3);
    this.#pedestal.color.setHex(dark ? 0x9aa7b6 : 0xf3f5f7);
    this.#shadow.opacity = dark ? 0.5 : 0.26;
  }
}
